// The many names of a few colour spaces.
#pragma once

#include <string>
#include <vector>

namespace mbfeat {

/// The transfer curve of a space, from code values to linear light.
enum class TransferCurve { kLinear, kSrgb, kGamma18, kGamma22, kAdobe };

/// A space given by the CIE xy chromaticities of red, green, blue and white, and a curve.
struct KnownSpace {
    std::vector<std::string> names; ///< first: its name in ACES configs; the others: aliases
    double xy[8];
    TransferCurve curve;
};

/// ITU-R BT.709 and BT.2020, SMPTE RP 431-2 with D65, Adobe RGB (1998) and SMPTE ST 2065-1 (AP0
/// and AP1), and the textures encoded from them, under the names of ACES configs, OpenUSD,
/// MaterialX and older configs.
const std::vector<KnownSpace>& knownSpaces();

/// The known space that has this name (case does not matter), or null.
const KnownSpace* findKnownSpace(const std::string& name);

} // namespace mbfeat
