#include "delegate/descriptors.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include <sys/resource.h>
#include <unistd.h>

#include "core/settings.h"
#include "delegate/renderParam.h"
#include "delegate/tokens.h"
#include "delegate/values.h"
#include "film/aovTable.h"
#include "pxr/base/gf/vec2f.h"
#include "pxr/base/gf/vec3f.h"
#include "pxr/base/gf/vec4f.h"
#include "scene/dump.h"

namespace mbfeat {

namespace {

constexpr double kMebibyte = 1048576.0;

std::string viewAovLabel(const std::string& label) {
    std::string names;
    for (const AovDescriptor& aov : aovTable()) {
        names += (names.empty() ? "" : ", ") + aov.name;
    }
    return label + " (" + names + ", primvars:NAME)";
}

VtValue clearValueOf(const AovDescriptor& aov) {
    const float v = aov.clearValue;
    if (aov.type == AovType::kInt) {
        return VtValue(static_cast<int>(v));
    }
    switch (aov.width()) {
    case 1:
        return VtValue(v);
    case 2:
        return VtValue(GfVec2f(v));
    case 3:
        return VtValue(GfVec3f(v));
    default:
        return VtValue(GfVec4f(v));
    }
}

HdFormat formatOf(const AovDescriptor& aov) {
    const HdFormat first = aov.type == AovType::kInt ? HdFormatInt32 : HdFormatFloat32;
    const int width = std::clamp(aov.width(), 1, 4);
    return static_cast<HdFormat>(static_cast<int>(first) + width - 1);
}

double residentBytes() {
    std::ifstream statm("/proc/self/statm");
    double pages = 0.0;
    double resident = 0.0;
    statm >> pages >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double peakBytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) * 1024.0; // Linux counts kibibytes
}

double secondsOf(const RenderReport& report, const char* phase) {
    double seconds = 0.0;
    for (const auto& [name, value] : report.seconds) {
        seconds += name == phase ? value : 0.0;
    }
    return seconds;
}

std::string stageOf(const RenderParam& param) {
    const Renderer& renderer = param.renderer();
    if (renderer.isPaused()) {
        return "paused";
    }
    if (param.isStopped()) {
        return "stopped";
    }
    return renderer.isConverged() ? "finished" : "rendering";
}

std::string annotation(const RenderProgress& progress, const std::string& stage) {
    const auto percent = static_cast<int>(std::floor(progress.fraction * 100.0));
    std::string text = stage + ", " + std::to_string(percent) + " %";
    if (progress.samplesPerSecond > 0.0) {
        text += ", " + std::to_string(std::llround(progress.samplesPerSecond)) + " samples/s";
    }
    if (progress.secondsLeft > 0.0) {
        text += ", " + std::to_string(std::llround(progress.secondsLeft)) + " s left";
    }
    return text;
}

} // namespace

HdRenderSettingDescriptorList settingDescriptors() {
    HdRenderSettingDescriptorList list;
    for (const SettingDescriptor& setting : settingTable()) {
        const std::string label =
            setting.name == "mbfeat:viewAov" ? viewAovLabel(setting.label) : setting.label;
        list.push_back({label, TfToken(setting.name), toVtValue(setting.defaultValue)});
    }
    return list;
}

HdAovDescriptor aovDescriptor(const TfToken& name) {
    const std::optional<AovDescriptor> aov = findAov(aovOfHostName(name.GetString()));
    if (!aov) {
        return HdAovDescriptor();
    }
    return {formatOf(*aov), false, clearValueOf(*aov)};
}

VtDictionary renderStatistics(const RenderParam& param) {
    const RenderProgress progress = param.renderer().progress();
    const RenderReport report = param.renderer().report();
    const RenderOptions options = param.settings().options();
    const std::string stage = stageOf(param);
    VtDictionary stats;
    stats["rendererName"] = VtValue(std::string("MBFeat"));
    stats["rendererStage"] = VtValue(stage);
    stats["fractionDone"] = VtValue(progress.fraction);
    stats["percentDone"] = VtValue(progress.fraction * 100.0);
    stats["renderProgressAnnotation"] = VtValue(annotation(progress, stage));
    stats["numCompletedSamples"] =
        VtValue(static_cast<int>(std::floor(progress.fraction * report.samplesPerPixel)));
    stats["totalClockTime"] = VtValue(progress.seconds);
    stats["secondsLeft"] = VtValue(progress.secondsLeft);
    stats["stopReason"] = VtValue(std::string(stopReasonName(report.sampling.stop)));
    if (report.sampling.error) {
        stats["estimatedError"] = VtValue(report.sampling.error->whole);
        stats["estimatedError95"] = VtValue(report.sampling.error->percentile95);
    }
    stats["loadClockTime"] = VtValue(secondsOf(report, "commit"));
    stats["totalMemory"] = VtValue(residentBytes() / kMebibyte);
    stats["peakMemory"] = VtValue(peakBytes() / kMebibyte);
    stats["numNonFiniteSamples"] = VtValue(static_cast<double>(report.trace.nonFinite));
    stats["numSkippedPrims"] = VtValue(param.skippedPrims());
    stats["numWarnings"] = VtValue(report.warnings);
    stats["seed"] = VtValue(static_cast<double>(options.seed));
    stats["huskErrorStatus"] = VtValue(report.errors.empty() ? 0 : 1);
    return stats;
}

bool writeSceneDump(RenderParam& param, const HdCommandArgs& args) {
    const std::string file = asText(findSettingValue(args, "file")).value_or("");
    std::ofstream stream(file);
    stream << dumpScene(param.acquireSceneForEdit());
    stream.close();
    if (stream.fail()) {
        Diagnostics(param.diagnostics()) // no fault of any image: it stands for this call only
            .error("dumpScene", "cannot write \"" + file +
                                    "\"; nothing is written. Give a writable path as the argument "
                                    "file.");
        return false;
    }
    return true;
}

} // namespace mbfeat
