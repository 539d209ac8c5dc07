#include "denoise/channels.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "core/floatTraps.h"
#include "core/library.h"

extern "C" std::uint32_t writeChannelsOnLanes(const mbfeat::ChannelPlan* plan,
                                              const float* const* paths, int count, float* out);

namespace mbfeat {

namespace {

using Kind = ChannelSource::Kind;

/// Bits of a vertex's event, as PathEvent has them: the film's paths are plain numbers here.
constexpr std::array<std::pair<const char*, std::uint32_t>, 4> kEventBits = {
    {{"reflect", 1U}, {"transmit", 2U}, {"diffuse", 4U}, {"specular", 16U}}};

struct Name {
    std::string stem, component; ///< "mbfeat:normal:0" and "X"
    int vertex = -1;             ///< the number at the end of the stem
};

Name parsed(const std::string& channel) {
    Name name;
    const std::size_t dot = channel.rfind('.');
    name.stem = channel.substr(0, dot);
    name.component = dot == std::string::npos ? std::string() : channel.substr(dot + 1);
    if (name.stem.size() > 1 && name.stem[name.stem.size() - 2] == ':' && name.stem.back() >= '0' &&
        name.stem.back() <= '9') {
        name.vertex = name.stem.back() - '0';
    }
    return name;
}

/// Bits of a float without its sign: they grow with its size, and those of infinity and of what is
/// no number are the largest.
std::uint32_t magnitudeBits(float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    return bits & 0x7FFFFFFFU;
}
constexpr std::uint32_t kInfinityBits = 0x7F800000U;
/// Words of paths whose memory ends with a whole quad.
constexpr std::size_t kWholeQuads = std::size_t{1} << 62U;

bool isShown(const Name& name, const std::string& channel, ShownFeatures shown) {
    switch (shown) {
    case ShownFeatures::kAll:
        return true;
    case ShownFeatures::kFirstHit:
        return name.vertex <= 0;
    case ShownFeatures::kNone:
        break;
    }
    return name.vertex < 0 && channel != "Z";
}

/// Whether the fields from `first` on lie side by side, floats all of them.
bool isRow(const std::vector<PathFieldPlace>& places, std::size_t first, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        if (first + i >= places.size() || places[first + i].word != places[first].word + i ||
            places[first + i].kind != PathFieldPlace::Kind::kFloat) {
            return false;
        }
    }
    return true;
}

} // namespace

Result<ChannelPlan> ChannelPlan::make(const std::vector<std::string>& channels,
                                      const PathSamples& paths, ShownFeatures shown,
                                      const std::vector<std::string>& lights) {
    const auto find = [&](const std::string& field) -> std::optional<std::size_t> {
        const auto found = std::find(paths.fields.begin(), paths.fields.end(), field);
        if (found == paths.fields.end()) {
            return std::nullopt;
        }
        return static_cast<std::size_t>(std::distance(paths.fields.begin(), found));
    };
    ChannelPlan plan;
    std::vector<PathFieldPlace> places = paths.places;
    for (std::size_t i = places.size(); i < paths.fields.size(); ++i) {
        places.push_back({i});
    }
    std::copy(std::begin(paths.worldToCamera), std::end(paths.worldToCamera), plan.rotation_);
    std::string missing;
    for (const std::string& channel : channels) {
        const Name name = parsed(channel);
        ChannelSource source;
        std::string field = channel;
        source.kind = Kind::kField;
        const std::string event = channel.substr(0, channel.find(':'));
        const auto* const bit =
            std::find_if(kEventBits.begin(), kEventBits.end(),
                         [&](const auto& known) { return event == known.first; });
        if (event == "valid") {
            source.kind = Kind::kBit;
            source.bits = 1U << static_cast<unsigned>(std::max(name.vertex, 0));
            field = "validMask";
        } else if (bit != kEventBits.end()) {
            source.kind = Kind::kBit;
            source.bits = bit->second;
            field = "mbfeat:event:" + std::to_string(name.vertex) + ".Y";
        } else if (channel.find(":normal:") != std::string::npos) {
            source.kind = Kind::kDirection;
            source.axis = name.component == "X" ? 0 : name.component == "Y" ? 1 : 2;
            field = name.stem + ".X";
        }
        const std::optional<std::size_t> place = find(field);
        if (!place) {
            missing += (missing.empty() ? "" : ", ") + field;
            continue;
        }
        source.field = places[*place].word;
        source.form = places[*place].kind;
        if (!isShown(name, channel, shown)) {
            source.kind = Kind::kZero;
        }
        plan.append(source);
    }
    if (!missing.empty()) {
        constexpr std::size_t kLongest = 200;
        if (missing.size() > kLongest) {
            missing = missing.substr(0, kLongest) + " ...";
        }
        return Error{"mbfeat:denoise:model",
                     "the network needs what these path samples do not have (" + missing +
                         "); the image is not denoised. Record it, with mbfeat:event:0 among a "
                         "deep product's AOVs for the extended set, or take another network."};
    }
    for (const std::string& name : lights) {
        const std::optional<std::size_t> place = find(name);
        if (!place || !isRow(places, *place, 3)) {
            return Error{name, "the path samples do not have this colour; the image is not "
                               "denoised."};
        }
        plan.lights_.push_back(places[*place].word);
    }
    plan.findWords(paths.places.empty() ? paths.fields.size() : kWholeQuads);
    return plan;
}

void ChannelPlan::append(const ChannelSource& source) {
    ++size_;
    if (!sources_.empty() && sources_.back().kind == source.kind) {
        ChannelSource& last = sources_.back();
        const bool follows =
            source.kind == Kind::kZero ||
            (source.kind == Kind::kField && source.field == last.field + last.count);
        if (follows) {
            ++last.count;
            return;
        }
    }
    sources_.push_back(source);
}

void ChannelPlan::findWords(std::size_t pathWords) {
    std::set<std::size_t> words, numbers;
    for (const ChannelSource& source : sources_) {
        const bool isDirection = source.kind == Kind::kDirection;
        const std::size_t count = source.kind == Kind::kZero ? 0 : isDirection ? 3 : source.count;
        for (std::size_t i = 0; i < count; ++i) {
            words.insert(source.field + i);
        }
        if (source.kind == Kind::kBit && source.form != PathFieldPlace::Kind::kFloat &&
            numbers.insert(source.field).second) {
            numbers_.push_back({source.field, source.form});
        }
    }
    for (const std::size_t light : lights_) {
        words.insert({light, light + 1, light + 2});
    }
    constexpr std::size_t kQuad = 4;
    for (const std::size_t word : words) {
        const std::size_t quad = word / kQuad * kQuad;
        if (pathWords - quad < kQuad) {
            singles_.push_back(word);
        } else if (quads_.empty() || quads_.back() != quad) {
            quads_.push_back(quad);
        }
    }
    words_ = words.empty() ? 0 : *words.rbegin() / kQuad * kQuad + kQuad;
}

bool ChannelPlan::write(const float* path, float* out, std::size_t stride) const {
    std::uint32_t largest = 0;
    const auto look = [&largest](float value) {
        largest = std::max(largest, magnitudeBits(value));
    };
    float* to = out;
    for (const ChannelSource& source : sources_) {
        switch (source.kind) {
        case Kind::kZero:
            for (std::size_t i = 0; i < source.count; ++i, to += stride) {
                *to = 0.0F;
            }
            break;
        case Kind::kField: {
            const float* const from = path + source.field;
            for (std::size_t i = 0; i < source.count; ++i, to += stride) {
                *to = from[i];
                look(from[i]);
            }
            break;
        }
        case Kind::kDirection: {
            const float* const world = path + source.field;
            const float* const axis = rotation_ + 3 * source.axis;
            look(world[0]);
            look(world[1]);
            look(world[2]);
            // Of what is no number nothing is computed, see floatTraps.h.
            *to = largest < kInfinityBits
                      ? axis[0] * world[0] + axis[1] * world[1] + axis[2] * world[2]
                      : 0.0F;
            look(*to);
            to += stride;
            break;
        }
        case Kind::kBit: {
            const float number = PathFieldPlace{source.field, source.form}.read(path);
            const bool isNumber = number >= 0.0F && number < 4294967040.0F;
            const auto bits = isNumber ? static_cast<std::uint32_t>(number) : 0U;
            *to = (bits & source.bits) != 0 ? 1.0F : 0.0F;
            largest = isNumber ? largest : kInfinityBits;
            to += stride;
            break;
        }
        }
    }
    for (const std::size_t light : lights_) {
        look(path[light]);
        look(path[light + 1]);
        look(path[light + 2]);
    }
    const bool finite = largest < kInfinityBits;
    for (std::size_t i = 0; !finite && i < size_; ++i) {
        out[i * stride] = 0.0F;
    }
    return finite;
}

std::uint32_t ChannelPlan::writeGroup(const float* const* paths, int count, float* out) const {
    static const auto write = widest("writeChannelsOnWideLanes", &writeChannelsOnLanes);
    const FloatTrapsMasked masked;
    return write(this, paths, count, out);
}

} // namespace mbfeat
