// The one table of AOVs: name, type, width, default, meaning, who needs it. Delegate descriptors,
// EXR layers, the Python layout, the docs and the tests are read from it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mbfeat {

/// How the samples of a pixel become its value.
enum class AovReduction : std::uint8_t {
    kMean,     ///< filter-weighted mean over the pixel's samples
    kNearest,  ///< the sample nearest the pixel centre (ids, depths: their mean means nothing)
    kSum,      ///< samples for which a bool of the record is true; without a field, all samples
    kVariance, ///< unbiased variance of the mean of `color`, per channel
};

enum class AovType : std::uint8_t { kFloat, kInt };

/// recordOffset of what the film knows by itself: the number of samples.
inline constexpr std::size_t kNoRecordField = static_cast<std::size_t>(-1);

struct AovDescriptor {
    std::string name; ///< "mbfeat:albedo:0", "color", "primvars:st"
    AovType type = AovType::kFloat;
    std::vector<std::string>
        channels; ///< EXR channel suffixes: {"R","G","B"}, {"X","Y","Z"}, {"Z"}, ...
    AovReduction reduction = AovReduction::kMean;
    std::size_t recordOffset = 0;  ///< bytes into PathRecord of the first value, or kNoRecordField
    std::uint32_t recordFlags = 0; ///< RecordFlags the integrator must be asked for
    float clearValue = 0.0F;       ///< at the background (ids -1, depth 1)
    int vertex = -1;               ///< 0..5 for per-vertex AOVs
    std::string doc;               ///< one sentence: meaning, unit, space

    int width() const { return static_cast<int>(channels.size()); }
};

/// Every AOV with a fixed name, in layout order: the standard ones, the 18 of the paper, the
/// contributions, first non-delta, the extended set.
const std::vector<AovDescriptor>& aovTable();

/// The descriptor of a name, `primvars:*` included; nothing if there is no such AOV. A primvar's
/// recordOffset is that of slot 0 of PathRecord::primvars. Its width is not known before the scene
/// is: displayColor is R, G, B, displayOpacity is A, and any other X, Y, Z with zeros for
/// components that the primvar does not have.
std::optional<AovDescriptor> findAov(const std::string& name);

/// The AOV that a host means which needs identifiers for names and so writes "mbfeat_albedo_0" and
/// "primvars_st" for mbfeat:albedo:0 and primvars:st. Any other name comes back as it is.
std::string aovOfHostName(const std::string& name);

/// The table's name that is nearest to a misspelt one, for error messages.
std::string nearestAovName(const std::string& name);

} // namespace mbfeat
