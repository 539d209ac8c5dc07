// Radiance HDR (RGBE) images, after the file format description in "Real Pixels" (Ward, Graphics
// Gems II, 1991) and the Radiance reference manual.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <Imath/half.h>

#include "scene/imageDecoder.h"

namespace mbfeat {

namespace {

struct Rgbe {
    std::uint8_t v[4] = {0, 0, 0, 0};
};

/// Reads bytes in order; past the end it gives zeros and says so.
class Reader {
public:
    explicit Reader(const std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

    std::uint8_t next() {
        ranOut_ = ranOut_ || position_ >= bytes_.size();
        return ranOut_ ? std::uint8_t(0) : bytes_[position_++];
    }
    std::uint8_t peek(std::size_t ahead) const {
        return position_ + ahead < bytes_.size() ? bytes_[position_ + ahead] : std::uint8_t(0);
    }
    std::string line() {
        std::string text;
        for (char c = static_cast<char>(next()); c != '\n' && !ranOut_;
             c = static_cast<char>(next())) {
            text += c;
        }
        return text;
    }
    bool ranOut() const { return ranOut_; }

private:
    const std::vector<std::uint8_t>& bytes_;
    std::size_t position_ = 0;
    bool ranOut_ = false;
};

struct Header {
    int width = 0, height = 0;
    bool bottomUp = false, rightToLeft = false;
    double scale = 1.0; ///< from texel values to radiance
    bool isXyz = false;
};

/// The resolution line, "-Y 512 +X 1024". Images stored by columns are not supported.
Status readResolution(const std::string& path, const std::string& line, Header& header) {
    char signY = 0;
    char signX = 0;
    if (std::sscanf(line.c_str(), "%cY %d %cX %d", &signY, &header.height, &signX, &header.width) !=
            4 ||
        (signY != '-' && signY != '+') || (signX != '-' && signX != '+')) {
        return Error{path, "has the resolution line '" + line.substr(0, 40) +
                               "', which is damaged or an orientation that is not supported"};
    }
    header.bottomUp = signY == '+';
    header.rightToLeft = signX == '-';
    return std::nullopt;
}

Status readHeader(const std::string& path, Reader& reader, Header& header) {
    bool hasFormat = false;
    for (std::string line = reader.line(); !line.empty(); line = reader.line()) {
        if (reader.ranOut()) {
            return Error{path, kTruncatedText};
        }
        if (line.rfind("FORMAT=", 0) == 0) {
            header.isXyz = line.find("32-bit_rle_xyze") != std::string::npos;
            hasFormat = header.isXyz || line.find("32-bit_rle_rgbe") != std::string::npos;
        } else if (line.rfind("EXPOSURE=", 0) == 0) {
            const double exposure = std::strtod(line.c_str() + 9, nullptr);
            // Values were multiplied by it when written; several lines multiply up.
            header.scale /= std::isnormal(exposure) && exposure > 0.0 ? exposure : 1.0;
        }
    }
    if (!hasFormat) {
        return Error{path, "is a Radiance file of a format other than 32-bit_rle_rgbe or _xyze"};
    }
    if (Status error = readResolution(path, reader.line(), header)) {
        return error;
    }
    return checkImageSize(path, header.width, header.height, 3 * sizeof(float));
}

/// A scanline of the new run-length encoding: each of the four components by itself.
bool readComponentRuns(Reader& reader, std::vector<Rgbe>& line) {
    for (int component = 0; component < 4; ++component) {
        std::size_t x = 0;
        while (x < line.size()) {
            std::size_t count = reader.next();
            const bool isRun = count > 128;
            count -= isRun ? 128 : 0;
            if (count == 0 || count > line.size() - x) {
                return false;
            }
            std::uint8_t value = isRun ? reader.next() : std::uint8_t(0);
            for (; count > 0; --count) {
                value = isRun ? value : reader.next();
                line[x++].v[component] = value;
            }
        }
    }
    return true;
}

/// A flat scanline, or one of the old run-length encoding: (1, 1, 1, n) repeats the last texel.
bool readFlat(Reader& reader, std::vector<Rgbe>& line) {
    std::size_t x = 0;
    int shift = 0;
    while (x < line.size() && !reader.ranOut()) {
        Rgbe texel;
        for (std::uint8_t& value : texel.v) {
            value = reader.next();
        }
        if (texel.v[0] != 1 || texel.v[1] != 1 || texel.v[2] != 1) {
            line[x++] = texel;
            shift = 0;
            continue;
        }
        const std::size_t count = static_cast<std::size_t>(texel.v[3]) << shift;
        if (x == 0 || count > line.size() - x || shift > 16) {
            return false;
        }
        for (std::size_t i = 0; i < count; ++i, ++x) {
            line[x] = line[x - 1];
        }
        shift += 8;
    }
    return true;
}

bool readScanline(Reader& reader, std::vector<Rgbe>& line) {
    const bool byComponent = line.size() >= 8 && line.size() < 32768 && reader.peek(0) == 2 &&
                             reader.peek(1) == 2 && reader.peek(2) < 128;
    if (!byComponent) {
        return readFlat(reader, line);
    }
    reader.next();
    reader.next();
    const std::size_t length = static_cast<std::size_t>(reader.next()) << 8;
    return length + reader.next() == line.size() && readComponentRuns(reader, line);
}

/// Texels are mantissas with a common exponent: (v + 0) / 256 * 2^(e - 128), 0 when e is 0.
void convertLine(const std::vector<Rgbe>& line, const Header& header, float* out) {
    for (std::size_t x = 0; x < line.size(); ++x) {
        const Rgbe& texel = line[header.rightToLeft ? line.size() - 1 - x : x];
        const double unit =
            texel.v[3] == 0 ? 0.0 : std::ldexp(header.scale, static_cast<int>(texel.v[3]) - 136);
        for (std::size_t c = 0; c < 3; ++c) {
            out[3 * x + c] = static_cast<float>(unit * texel.v[c]);
        }
    }
}

/// Halves have more mantissa bits than RGBE, so they are used unless their range is too small.
void packHalf(DecodedImage& image) {
    constexpr float kLargestHalf = 65504.0F;
    const std::size_t count = image.data.size() / sizeof(float);
    const auto value = [&image](std::size_t i) {
        float v = 0.0F;
        std::memcpy(&v, image.data.data() + i * sizeof(float), sizeof(float));
        return v;
    };
    for (std::size_t i = 0; i < count; ++i) {
        if (!(value(i) <= kLargestHalf)) {
            return;
        }
    }
    for (std::size_t i = 0; i < count; ++i) {
        const Imath::half h(value(i));
        std::memcpy(image.data.data() + i * sizeof(h), &h, sizeof(h));
    }
    image.data.resize(count * sizeof(Imath::half));
    image.data.shrink_to_fit();
    image.storage = Image::Storage::kHalf;
}

} // namespace

Result<DecodedImage> decodeRadianceImage(const std::string& path,
                                         const std::vector<std::uint8_t>& bytes) {
    Reader reader(bytes);
    Header header;
    if (Status error = readHeader(path, reader, header)) {
        return *error;
    }
    DecodedImage image;
    image.width = header.width;
    image.height = header.height;
    image.channels = 3;
    image.hasColorSpace = true;
    image.colorSpace = header.isXyz ? "lin_ciexyzd65_scene" : "lin_rec709";
    const auto width = static_cast<std::size_t>(header.width);
    const auto height = static_cast<std::size_t>(header.height);
    // The buffer grows with what the file really holds, so a damaged header costs no memory.
    std::vector<Rgbe> texels;
    std::vector<Rgbe> line(width);
    for (std::size_t y = 0; y < height; ++y) {
        if (!readScanline(reader, line) || reader.ranOut()) {
            return Error{path, reader.ranOut() ? kTruncatedText
                                               : "has damaged run lengths; write it again"};
        }
        texels.insert(texels.end(), line.begin(), line.end());
    }
    image.data.resize(width * height * 3 * sizeof(float));
    std::vector<float> values(width * 3);
    for (std::size_t y = 0; y < height; ++y) {
        line.assign(texels.begin() + static_cast<std::ptrdiff_t>(y * width),
                    texels.begin() + static_cast<std::ptrdiff_t>((y + 1) * width));
        convertLine(line, header, values.data());
        const std::size_t row = header.bottomUp ? y : height - 1 - y;
        std::memcpy(image.data.data() + row * values.size() * sizeof(float), values.data(),
                    values.size() * sizeof(float));
    }
    packHalf(image);
    return image;
}

} // namespace mbfeat
