// The effects that a scene may call for: one table of names and meanings. The census finds them,
// the kernels leave out what is absent, the setting mbfeat:effects adds and takes away.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/diagnostics.h"

namespace mbfeat {

enum class Effect : std::uint8_t {
    // What surfaces do.
    kReflection,
    kMetal,
    kSpecularWorkflow,
    kClearcoat,
    kTransmission,
    kRoughGlass,
    kCutouts,
    kTextures,
    kNormalMaps,
    kPrimvars,
    kEmissiveGeometry,
    // What lights.
    kEnvironment,
    kAreaLights,
    kLightTextures,
    kLightShaping,
    kLightMultipliers,
    kShadowlessLights,
    kSeveralLights,
    kManyLights,
    // How the scene is built and seen.
    kInstancing,
    kDepthOfField,
    // What of the paths is kept beside `color`.
    kPathFeatures,
    kContributions,
    kExtendedFeatures,
    kFirstNonDelta,
    kFirstHit,
    kPrimvarAovs,
    kPathSamples,
};
inline constexpr std::size_t kEffectCount = 28;

struct EffectDescriptor {
    Effect effect;
    const char* name; ///< in reports and in mbfeat:effects
    const char* doc;  ///< when a scene calls for it
    /// What stands in its place where mbfeat:effects takes it away; null: it cannot be.
    const char* without;
};

/// In the order of the enumeration.
const std::array<EffectDescriptor, kEffectCount>& effectTable();
const char* effectName(Effect effect);

/// A set of effects.
class EffectSet {
public:
    constexpr EffectSet() = default;
    constexpr EffectSet(Effect effect) : bits_(std::uint64_t{1} << index(effect)) {}
    static constexpr EffectSet all() { return EffectSet((std::uint64_t{1} << kEffectCount) - 1U); }

    constexpr bool has(Effect effect) const { return (bits_ >> index(effect) & 1U) != 0; }
    constexpr bool empty() const { return bits_ == 0; }
    constexpr std::uint64_t bits() const { return bits_; }
    constexpr EffectSet operator|(EffectSet o) const { return EffectSet(bits_ | o.bits_); }
    constexpr EffectSet operator&(EffectSet o) const { return EffectSet(bits_ & o.bits_); }
    constexpr EffectSet operator-(EffectSet o) const { return EffectSet(bits_ & ~o.bits_); }
    EffectSet& operator|=(EffectSet o) { return *this = *this | o; }
    constexpr bool operator==(EffectSet o) const { return bits_ == o.bits_; }
    constexpr bool operator!=(EffectSet o) const { return bits_ != o.bits_; }

private:
    explicit constexpr EffectSet(std::uint64_t bits) : bits_(bits) {}
    static constexpr unsigned index(Effect effect) { return static_cast<unsigned>(effect); }

    std::uint64_t bits_ = 0;
};

/// The names of a set, in table order.
std::vector<std::string> effectNames(EffectSet set);

/// What the setting mbfeat:effects says.
struct EffectRequest {
    bool full = false; ///< the kernel with all effects, whatever the scene calls for
    EffectSet forced;  ///< handled as if the scene called for them
    EffectSet taken;   ///< taken away from the scene
    bool operator==(const EffectRequest& o) const {
        return full == o.full && forced == o.forced && taken == o.taken;
    }
};

/// From "auto", "full", or a list such as "auto, -textures, +clearcoat". An error names the word
/// that is wrong and the nearest effect.
Result<EffectRequest> parseEffects(const std::string& text);

} // namespace mbfeat
