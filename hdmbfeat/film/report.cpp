#include "film/report.h"

#include <algorithm>
#include <variant>

#include "film/json.h"

namespace mbfeat {

namespace {

using Attributes = std::vector<std::pair<std::string, std::string>>;

std::string join(const std::vector<std::string>& texts) {
    std::string joined;
    for (const std::string& text : texts) {
        joined += (joined.empty() ? "" : ", ") + text;
    }
    return joined.empty() ? "none" : joined;
}

void writeSettings(JsonWriter& json, const std::vector<Settings::Resolved>& settings) {
    json.key("settings").beginObject();
    for (const Settings::Resolved& setting : settings) {
        json.key(setting.name).beginObject().key("value");
        std::visit([&](const auto& value) { json.value(value); }, setting.value);
        json.key("source").value(settingSourceName(setting.source)).endObject();
    }
    json.endObject();
}

void writeScene(JsonWriter& json, const EffectCensus& census) {
    json.key("effects").beginObject();
    json.key("present").value(census.present);
    json.key("absent").value(census.absent);
    json.key("askedBy").beginObject();
    for (const EffectDescriptor& row : effectTable()) {
        const EffectUse& use = census.uses[static_cast<std::size_t>(row.effect)];
        if (use.count > 0) {
            json.key(row.name).beginObject();
            json.key("count").value(static_cast<std::uint64_t>(use.count));
            json.key("first").value(use.first).endObject();
        }
    }
    json.endObject().endObject();
    json.key("scene").beginObject();
    json.key("triangles").value(static_cast<std::uint64_t>(census.triangles));
    json.key("instances").value(static_cast<std::uint64_t>(census.instances));
    json.key("lights").value(static_cast<std::uint64_t>(census.lights));
    json.key("textureBytes").value(static_cast<std::uint64_t>(census.textureBytes)).endObject();
}

void writeSampling(JsonWriter& json, const SamplingOutcome& sampling) {
    json.key("sampling").beginObject();
    json.key("fewest").value(static_cast<std::uint64_t>(sampling.fewest));
    json.key("mean").value(sampling.mean);
    json.key("most").value(static_cast<std::uint64_t>(sampling.most));
    json.key("stopped").value(stopReasonName(sampling.stop));
    if (sampling.error) {
        json.key("estimatedError").value(sampling.error->whole);
        json.key("estimatedError95").value(sampling.error->percentile95);
    }
    json.key("forecasts").beginArray();
    for (const Forecast& forecast : sampling.forecasts) {
        json.beginObject().key("samples").value(forecast.samples);
        json.key("allSamples").value(forecast.allSamples);
        json.key("seconds").value(forecast.seconds);
        json.key("allSeconds").value(forecast.allSeconds).endObject();
    }
    json.endArray();
    json.endObject();
}

void writeTrace(JsonWriter& json, const TraceStatistics& trace) {
    json.key("trace").beginObject();
    json.key("paths").value(trace.paths);
    json.key("rays").value(trace.rays);
    json.key("shadowRays").value(trace.shadowRays);
    json.key("nonFinite").value(trace.nonFinite).endObject();
}

void writeKernel(JsonWriter& json, const KernelChoice& kernel) {
    json.key("kernel").beginObject();
    json.key("instructions").value(kernel.instructions);
    json.key("prebuilt").value(kernel.prebuilt);
    json.key("branches").value(kernel.branches);
    json.key("handled").value(effectNames(kernel.handled)).endObject();
}

void writeBuilds(JsonWriter& json, const BuildStatistics& builds) {
    json.key("builds").beginObject();
    json.key("meshes").value(builds.accel.meshes);
    json.key("placements").value(builds.accel.placements);
    json.key("topBvh").value(builds.accel.top);
    json.key("lightBvh").value(builds.accel.lights);
    json.key("materialBindings").value(builds.accel.bindings);
    json.key("lightTables").value(builds.lightTables);
    json.key("imagesLoaded").value(builds.images).endObject();
}

void writeMemory(JsonWriter& json, const RenderReport& report) {
    const MemoryStatistics& memory = report.memory;
    const auto write = [&json](const char* name, std::size_t value) {
        json.key(name).value(static_cast<std::uint64_t>(value));
    };
    json.key("memory").beginObject();
    write("workers", report.workers);
    write("pathStateBytesEach", memory.pathStates);
    write("recordBytesEach", memory.records);
    write("filmBytes", report.filmBytes);
    write("filmAovs", report.filmAovs);
    write("images", memory.imageCount);
    write("imageBytes", memory.images);
    write("primvars", memory.primvarCount);
    write("primvarBytes", memory.primvars);
    write("normalBytes", memory.normals);
    write("emitterBytes", memory.emitters);
    write("lightsInBvh", memory.lightsInBvh);
    json.endObject();
}

} // namespace

double RenderReport::totalSeconds() const {
    double total = 0.0;
    for (const auto& [phase, duration] : seconds) {
        total += duration;
    }
    return total;
}

std::string RenderReport::json() const {
    JsonWriter json;
    json.beginObject();
    json.key("version").value(version);
    json.key("stage").value(stage);
    json.key("frame").value(frame);
    json.key("samplesPerPixel").value(samplesPerPixel);
    json.key("interrupted").value(interrupted);
    writeSampling(json, sampling);
    writeSettings(json, settings);
    writeScene(json, census);
    writeTrace(json, trace);
    writeKernel(json, kernel);
    json.key("branches").beginArray();
    for (const int count : branches) {
        json.value(count);
    }
    json.endArray();
    writeBuilds(json, builds);
    writeMemory(json, *this);
    json.key("seconds").beginArray();
    for (const auto& [phase, duration] : seconds) {
        json.beginObject().key("phase").value(phase);
        json.key("seconds").value(duration).endObject();
    }
    json.endArray();
    json.key("totalSeconds").value(totalSeconds());
    json.key("samplingCpuSeconds").value(samplingCpuSeconds);
    json.key("written").value(written);
    json.key("errors").value(errors);
    json.key("warnings").value(warnings);
    json.endObject();
    return json.text();
}

Attributes RenderReport::headerAttributes() const {
    Attributes attributes;
    const auto add = [&](const std::string& name, std::string value) {
        attributes.emplace_back("mbfeat:" + name, std::move(value));
    };
    add("version", version);
    if (!stage.empty()) {
        add("stage", stage);
    }
    add("frame", std::to_string(frame));
    const auto seed =
        std::find_if(settings.begin(), settings.end(), [](const Settings::Resolved& setting) {
            return setting.name == "mbfeat:seed";
        });
    if (seed != settings.end()) {
        add("seed", toString(seed->value));
    }
    add("samplesPerPixel", std::to_string(samplesPerPixel));
    add("samplesTaken", "fewest " + std::to_string(sampling.fewest) + ", mean " +
                            toText(sampling.mean) + ", most " + std::to_string(sampling.most));
    std::vector<std::string> ofViews;
    for (const int count : branches) {
        ofViews.push_back(std::to_string(count));
    }
    add("branches", join(ofViews));
    add("stopped", stopReasonName(sampling.stop));
    if (sampling.error) {
        add("estimatedError", toText(sampling.error->whole));
        add("estimatedError95", toText(sampling.error->percentile95));
    }
    add("effects", join(census.present));
    add("effectsAbsent", join(census.absent));
    add("renderSeconds", toText(totalSeconds()));
    std::vector<std::string> phases;
    for (const auto& [phase, duration] : seconds) {
        phases.push_back(phase + " " + toText(duration));
    }
    add("phaseSeconds", join(phases));
    add("nonFiniteSamples", std::to_string(trace.nonFinite));
    if (interrupted) {
        add("interrupted", "The render was stopped before all samples were taken.");
    }
    for (const Settings::Resolved& setting : settings) {
        const std::size_t colon = setting.name.find(':');
        add("setting:" + setting.name.substr(colon == std::string::npos ? 0 : colon + 1),
            toString(setting.value) + " (" + settingSourceName(setting.source) + ")");
    }
    return attributes;
}

} // namespace mbfeat
