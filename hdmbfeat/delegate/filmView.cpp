#include "delegate/filmView.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "film/risingPass.h"

namespace mbfeat {

namespace {

/// Pixel values of an AOV, row 0 on top.
struct Pixels {
    std::vector<float> values;
    int channels = 0;
    int width = 0, height = 0;
};

Pixels resolveFloats(const Film& film, int aovIndex) {
    const AovDescriptor& aov = film.aovs()[static_cast<std::size_t>(aovIndex)];
    const PixelRect& data = film.window().data;
    Pixels pixels{{}, aov.width(), data.width, data.height};
    const std::size_t count =
        static_cast<std::size_t>(data.width) * static_cast<std::size_t>(data.height);
    pixels.values.resize(count * static_cast<std::size_t>(pixels.channels));
    if (aov.type == AovType::kFloat) {
        film.resolve(aovIndex, pixels.values.data());
        return pixels;
    }
    std::vector<std::int32_t> integers(pixels.values.size());
    film.resolveInt(aovIndex, integers.data());
    std::transform(integers.begin(), integers.end(), pixels.values.begin(),
                   [](std::int32_t i) { return static_cast<float>(i); });
    return pixels;
}

void spreadOverColor(Pixels& pixels) {
    if (pixels.channels == 4) {
        return;
    }
    const std::size_t count = pixels.values.size() / static_cast<std::size_t>(pixels.channels);
    std::vector<float> colors(count * 4);
    for (std::size_t i = 0; i < count; ++i) {
        const float* const in = &pixels.values[i * static_cast<std::size_t>(pixels.channels)];
        float* const out = &colors[i * 4];
        out[0] = in[0];
        out[1] = pixels.channels == 1 ? in[0] : in[1];
        out[2] = pixels.channels == 1 ? in[0] : pixels.channels == 2 ? 0.0F : in[2];
        out[3] = 1.0F;
    }
    pixels.values = std::move(colors);
    pixels.channels = 4;
}

/// The film's image as large as fits into the buffer and centred: buffer pixel to display pixel.
struct Fit {
    double scaleX, scaleY, offsetX, offsetY;

    Fit(const ImageWindow& window, int width, int height) {
        const double imageWidth = static_cast<double>(window.width) * window.pixelAspectRatio;
        const double scale = std::max(imageWidth / width, window.height / double(height));
        scaleX = scale / window.pixelAspectRatio;
        scaleY = scale;
        offsetX = 0.5 * (window.width - width * scaleX);
        offsetY = 0.5 * (window.height - height * scaleY);
    }
    int x(int pixel) const {
        return static_cast<int>(std::floor((pixel + 0.5) * scaleX + offsetX));
    }
    int y(int pixel) const {
        return static_cast<int>(std::floor((pixel + 0.5) * scaleY + offsetY));
    }
};

/// Nearest film pixel for every buffer pixel; those outside the data window get the clear value.
Pixels fitted(const Pixels& pixels, const ImageWindow& window, int width, int height,
              float clearValue) {
    Pixels result{{}, pixels.channels, width, height};
    const auto channels = static_cast<std::size_t>(pixels.channels);
    result.values.assign(
        static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * channels, clearValue);
    const Fit fit(window, width, height);
    for (int y = 0; y < height; ++y) {
        const int sourceY = fit.y(y) - window.data.y;
        for (int x = 0; x < width; ++x) {
            const int sourceX = fit.x(x) - window.data.x;
            const bool inside =
                sourceX >= 0 && sourceY >= 0 && sourceX < pixels.width && sourceY < pixels.height;
            if (inside) {
                const auto from =
                    static_cast<std::size_t>(sourceY) * static_cast<std::size_t>(pixels.width) +
                    static_cast<std::size_t>(sourceX);
                const auto to = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x);
                std::copy_n(&pixels.values[from * channels], channels,
                            &result.values[to * channels]);
            }
        }
    }
    return result;
}

} // namespace

void showFilm(const Film& film, int aovIndex, const FilmPlacement& placement,
              const std::vector<std::uint8_t>& sampled, bool asColor, RenderBuffer& buffer) {
    const AovDescriptor& aov = film.aovs()[static_cast<std::size_t>(aovIndex)];
    const ImageWindow& window = film.window();
    const int x = placement.bufferX + window.data.x;
    const int y = placement.bufferY + window.data.y;
    if (aov.type == AovType::kInt && !asColor && !placement.fit) {
        std::vector<std::int32_t> integers(static_cast<std::size_t>(window.data.width) *
                                           static_cast<std::size_t>(window.data.height));
        film.resolveInt(aovIndex, integers.data());
        fillFromCoarser(sampled, window.data.width, 1, integers.data());
        buffer.write(integers.data(), x, y, window.data.width, window.data.height);
        return;
    }
    Pixels pixels = resolveFloats(film, aovIndex);
    fillFromCoarser(sampled, pixels.width, pixels.channels, pixels.values.data());
    if (asColor) {
        spreadOverColor(pixels);
    }
    if (placement.fit) {
        const auto width = static_cast<int>(buffer.GetWidth());
        const auto height = static_cast<int>(buffer.GetHeight());
        pixels = fitted(pixels, window, width, height, aov.clearValue);
        buffer.write(pixels.values.data(), pixels.channels, 0, 0, width, height);
    } else {
        buffer.write(pixels.values.data(), pixels.channels, x, y, pixels.width, pixels.height);
    }
}

} // namespace mbfeat
