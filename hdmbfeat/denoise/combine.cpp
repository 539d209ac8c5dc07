#include "denoise/combine.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace mbfeat {

namespace {

constexpr int kRadius = 7; ///< of the neighbourhood: 15 x 15 pixels of three channels

/// Sums of each pixel's neighbourhood, in place.
void sumAround(std::vector<double>& values, int width, int height) {
    std::vector<double> line;
    const auto pass = [&](int length, std::size_t first, std::size_t stride) {
        line.resize(static_cast<std::size_t>(length));
        for (int i = 0; i < length; ++i) {
            line[static_cast<std::size_t>(i)] =
                values[first + static_cast<std::size_t>(i) * stride];
        }
        for (int i = 0; i < length; ++i) {
            double sum = 0.0;
            for (int j = std::max(i - kRadius, 0); j <= std::min(i + kRadius, length - 1); ++j) {
                sum += line[static_cast<std::size_t>(j)];
            }
            values[first + static_cast<std::size_t>(i) * stride] = sum;
        }
    };
    const auto columns = static_cast<std::size_t>(width);
    for (int y = 0; y < height; ++y) {
        pass(width, static_cast<std::size_t>(y) * columns, 1);
    }
    for (std::size_t x = 0; x < columns; ++x) {
        pass(height, x, columns);
    }
}

} // namespace

std::vector<float> combineWeights(const CombineInput& input) {
    const std::size_t pixels =
        static_cast<std::size_t>(input.width) * static_cast<std::size_t>(input.height);
    double mean = 0.0;
    for (std::size_t i = 0; i < 3 * pixels; ++i) {
        const auto z = static_cast<double>(input.reconstructed[i]);
        mean += std::isfinite(z) ? std::abs(z) : 0.0;
    }
    mean /= std::max(static_cast<double>(3 * pixels), 1.0);
    // A hundredth of the image's mean is dark.
    const double dark = 1e-4 * mean * mean + 1e-30;
    std::vector<double> noise(pixels, 0.0), difference(pixels, 0.0);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < pixels; ++i) {
            const std::size_t place = c * pixels + i;
            const auto z = static_cast<double>(input.reconstructed[place]);
            const double d = static_cast<double>(input.rendered[place]) - z;
            const auto v = static_cast<double>(input.variance[place]);
            if (std::isfinite(d) && std::isfinite(v)) {
                const double scale = 1.0 / (z * z + dark);
                noise[i] += v * scale;
                difference[i] += d * d * scale;
            }
        }
    }
    sumAround(noise, input.width, input.height);
    sumAround(difference, input.width, input.height);
    std::vector<float> weights(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        const bool differs = difference[i] > noise[i];
        weights[i] = differs ? static_cast<float>(1.0 - noise[i] / difference[i]) : 0.0F;
    }
    return weights;
}

} // namespace mbfeat
