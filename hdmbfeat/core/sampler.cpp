#include "core/sampler.h"

namespace mbfeat {

namespace {

/// A bijection of 64 bits with full avalanche: the SplitMix64 finaliser (Steele, Lea and Flood
/// 2014, with Stafford's constants "Mix13").
std::uint64_t mix64(std::uint64_t z) {
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
}

constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15ULL;

/// Adds a value to a key; the order of additions matters, so (x, y) and (y, x) differ.
std::uint64_t absorb(std::uint64_t key, std::uint64_t value) {
    return mix64((key + kGolden) ^ mix64(value + kGolden));
}

} // namespace

SamplerKey SamplerKey::make(int pixelX, int pixelY, std::uint32_t sampleIndex, std::uint64_t seed,
                            std::int64_t frame) {
    // No seed has so many bits (see the settings' table).
    const std::uint64_t sequence = (sampleIndex & kSecondSequence) != 0 ? 1ULL << 63U : 0;
    std::uint64_t key = absorb(0, seed ^ sequence);
    key = absorb(key, static_cast<std::uint64_t>(frame));
    key = absorb(key, (static_cast<std::uint64_t>(static_cast<std::uint32_t>(pixelX)) << 32U) |
                          static_cast<std::uint32_t>(pixelY));
    SamplerKey result;
    result.low = static_cast<std::uint32_t>(key);
    result.high = static_cast<std::uint32_t>(key >> 32U);
    result.index = sampling::reverseBits(sampleIndex & ~kSecondSequence);
    return result;
}

} // namespace mbfeat
