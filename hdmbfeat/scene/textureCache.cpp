#include <sys/stat.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <iterator>
#include <map>
#include <mutex>
#include <utility>

#include <Imath/half.h>

#include "scene/colorManagement.h"
#include "scene/imageDecoder.h"
#include "scene/texture.h"

namespace mbfeat {

namespace {

using Storage = Image::Storage;

/// Identifies the state of a file, to see whether one that failed has been replaced.
struct FileStamp {
    std::int64_t seconds = 0, nanoseconds = 0, size = -1;

    static FileStamp of(const std::string& path) {
        struct stat info = {};
        if (stat(path.c_str(), &info) != 0) {
            return {};
        }
        return {info.st_mtim.tv_sec, info.st_mtim.tv_nsec, info.st_size};
    }
    bool operator==(const FileStamp& o) const {
        return seconds == o.seconds && nanoseconds == o.nanoseconds && size == o.size;
    }
};

template <class Value>
std::size_t zeroNonFinite(std::vector<std::uint8_t>& data) {
    std::size_t count = 0;
    for (std::size_t i = 0; i + sizeof(Value) <= data.size(); i += sizeof(Value)) {
        Value value;
        std::memcpy(&value, data.data() + i, sizeof(Value));
        if (!std::isfinite(static_cast<float>(value))) {
            std::memset(data.data() + i, 0, sizeof(Value));
            ++count;
        }
    }
    return count;
}

std::size_t zeroNonFinite(DecodedImage& image) {
    return image.storage == Storage::kHalf    ? zeroNonFinite<Imath::half>(image.data)
           : image.storage == Storage::kFloat ? zeroNonFinite<float>(image.data)
                                              : 0;
}

/// What the values of a file mean and what has to be done to them.
struct ColorPlan {
    bool decodeSrgb = false;
    std::shared_ptr<const ColorTransform> transform; ///< after decoding; null: none
};

/// Rewrites the texels through `plan`: as halves where their range allows, else as floats.
/// Grey images become RGB, since a transform may colour them.
void applyPlan(const ColorPlan& plan, DecodedImage& decoded) {
    const int width = decoded.width;
    const int height = decoded.height;
    const bool hasAlpha = decoded.channels == 2 || decoded.channels == 4;
    const int channels = hasAlpha ? 4 : 3;
    const bool wide = decoded.storage == Storage::kFloat || decoded.storage == Storage::kUNorm16;
    const std::size_t rowValues =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
    const std::size_t valueBytes = wide ? sizeof(float) : sizeof(Imath::half);
    constexpr float kLargestHalf = 65504.0F;

    const Image source(width, height, decoded.channels, decoded.storage, std::move(decoded.data));
    std::vector<std::uint8_t> data(rowValues * valueBytes * static_cast<std::size_t>(height));
    std::vector<float> row(rowValues);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Float4 texel = source.texel(x, y);
            const float rgba[4] = {texel.x, texel.y, texel.z, texel.w};
            std::memcpy(row.data() + static_cast<std::size_t>(x * channels), rgba,
                        static_cast<std::size_t>(channels) * sizeof(float));
        }
        if (plan.decodeSrgb) {
            decodeSrgb(row.data(), static_cast<std::size_t>(width), channels);
        }
        if (plan.transform) {
            plan.transform->apply(row.data(), static_cast<std::size_t>(width), channels);
        }
        std::uint8_t* out = data.data() + static_cast<std::size_t>(y) * rowValues * valueBytes;
        for (std::size_t i = 0; i < rowValues; ++i) {
            if (wide) {
                std::memcpy(out + i * sizeof(float), &row[i], sizeof(float));
            } else {
                const Imath::half value(clamp(row[i], -kLargestHalf, kLargestHalf));
                std::memcpy(out + i * sizeof(value), &value, sizeof(value));
            }
        }
    }
    decoded.data = std::move(data);
    decoded.channels = channels;
    decoded.storage = wide ? Storage::kFloat : Storage::kHalf;
}

/// UsdPreviewSurface's rule for files that say nothing about their colours.
bool isSrgbByDefault(const DecodedImage& image) {
    return image.storage == Storage::kUNorm8 && image.channels >= 3;
}

/// The space of the file's values, as a name for wellKnownSpace() and ColorConfig.
std::string sourceSpace(const ImageKey& key, const DecodedImage& image) {
    switch (key.colorSpace) {
    case SourceColorSpace::kRaw:
        return "raw";
    case SourceColorSpace::kSrgb:
        return "sRGB";
    case SourceColorSpace::kNamed:
        if (!key.colorSpaceName.empty() && key.colorSpaceName != "auto") {
            return key.colorSpaceName;
        }
        break;
    case SourceColorSpace::kAuto:
        break;
    }
    if (image.hasColorSpace) {
        return image.colorSpace;
    }
    return isSrgbByDefault(image) ? "sRGB" : "raw";
}

} // namespace

struct TextureCache::Impl {
    /// One image, loaded under its own lock so that others load meanwhile. A thread that holds a
    /// slot's lock may take `mutex`, never the other way round.
    struct Slot {
        explicit Slot(Diagnostics& diagnostics) : messages(diagnostics) {}
        std::mutex mutex;
        Diagnostics messages; ///< about the file, as it was loaded last
        std::weak_ptr<const Image> image;
        bool failed = false;
        FileStamp stamp;
    };

    explicit Impl(Diagnostics& d) : diagnostics(d) {}

    std::atomic<std::uint64_t> loaded{0};

    std::shared_ptr<Slot> slot(const ImageKey& key) {
        const std::lock_guard lock(mutex);
        std::shared_ptr<Slot>& found = slots[key];
        if (!found) {
            found = std::make_shared<Slot>(diagnostics);
        }
        return found;
    }

    /// The images that somebody holds.
    std::vector<std::shared_ptr<const Image>> images() {
        std::vector<std::shared_ptr<Slot>> known;
        {
            const std::lock_guard lock(mutex);
            for (const auto& [key, slot] : slots) {
                known.push_back(slot);
            }
        }
        std::vector<std::shared_ptr<const Image>> held;
        for (const std::shared_ptr<Slot>& slot : known) {
            const std::lock_guard lock(slot->mutex);
            if (std::shared_ptr<const Image> image = slot->image.lock()) {
                held.push_back(std::move(image));
            }
        }
        return held;
    }

    std::string space() {
        const std::lock_guard lock(mutex);
        return renderingSpace;
    }

    /// Read when it is first needed: most stages need none.
    std::shared_ptr<const ColorConfig> colorConfig() {
        const std::lock_guard lock(configMutex);
        if (!config) {
            config = ColorConfig::fromEnvironment(diagnostics);
        }
        return config;
    }

    ColorPlan planColors(const std::string& from, const std::string& to, const std::string& subject,
                         const std::string& path, Diagnostics& messages);
    std::shared_ptr<const Image> load(const ImageKey& key, const std::string& subject,
                                      Diagnostics& messages);

    Diagnostics& diagnostics;
    std::mutex mutex; ///< guards slots and renderingSpace
    std::map<ImageKey, std::shared_ptr<Slot>> slots;
    std::string renderingSpace;
    std::mutex configMutex;
    std::shared_ptr<const ColorConfig> config;
};

ColorPlan TextureCache::Impl::planColors(const std::string& from, const std::string& to,
                                         const std::string& subject, const std::string& path,
                                         Diagnostics& messages) {
    ColorPlan plan;
    const WellKnownSpace source = wellKnownSpace(from);
    if (source == WellKnownSpace::kRaw) {
        return plan;
    }
    plan.decodeSrgb = source == WellKnownSpace::kSrgb;
    const bool linear = plan.decodeSrgb || source == WellKnownSpace::kLinearRec709;
    if (linear && wellKnownSpace(to) == WellKnownSpace::kLinearRec709) {
        return plan;
    }
    const auto transform = colorConfig()->transform(linear ? std::string() : from, to);
    if (!transform) {
        messages.warn(subject, "texture '" + path + "' keeps its colours unconverted: '" +
                                   transform.error().subject + "' " + transform.error().text);
    } else if (!transform.value()->isIdentity()) {
        plan.transform = transform.value();
    }
    return plan;
}

std::shared_ptr<const Image>
TextureCache::Impl::load(const ImageKey& key, const std::string& subject, Diagnostics& messages) {
    Result<DecodedImage> result = decodeImage(key.path);
    if (!result) {
        messages.warn(subject, "texture '" + key.path + "' " + result.error().text +
                                   "; the fallback value is used instead");
        return nullptr;
    }
    DecodedImage& image = result.value();
    if (!image.note.empty()) {
        messages.report(Severity::kInfo, subject, "texture '" + key.path + "' " + image.note);
    }
    std::size_t bad = zeroNonFinite(image);
    const ColorPlan plan =
        planColors(sourceSpace(key, image), space(), subject, key.path, messages);
    const bool hasSrgbStorage =
        image.storage == Storage::kUNorm8 || image.storage == Storage::kUNorm16;
    if (plan.decodeSrgb && !plan.transform && hasSrgbStorage) {
        image.storage = image.storage == Storage::kUNorm8 ? Storage::kSrgb8 : Storage::kSrgb16;
    } else if (plan.decodeSrgb || plan.transform) {
        applyPlan(plan, image);
        bad += zeroNonFinite(image);
    }
    if (bad > 0) {
        messages.warn(subject, "texture '" + key.path + "' has " + std::to_string(bad) +
                                   " values that are not finite; they are replaced by zero");
    }
    return std::make_shared<Image>(image.width, image.height, image.channels, image.storage,
                                   std::move(image.data));
}

TextureCache::TextureCache(Diagnostics& diagnostics) : impl_(std::make_unique<Impl>(diagnostics)) {}

TextureCache::~TextureCache() = default;

std::shared_ptr<const Image> TextureCache::get(const ImageKey& key, const std::string& subject) {
    const std::shared_ptr<Impl::Slot> slot = impl_->slot(key);
    const std::lock_guard lock(slot->mutex);
    if (std::shared_ptr<const Image> image = slot->image.lock()) {
        return image;
    }
    if (slot->failed && slot->stamp == FileStamp::of(key.path)) {
        return nullptr;
    }
    slot->stamp = FileStamp::of(key.path);
    slot->messages.withdraw();
    std::shared_ptr<const Image> image;
    try {
        image = impl_->load(key, subject, slot->messages);
    } catch (const std::exception& e) {
        slot->messages.warn(subject, "texture '" + key.path + "' could not be loaded: " + e.what() +
                                         "; the fallback value is used instead");
    }
    slot->failed = image == nullptr;
    impl_->loaded += image != nullptr ? 1U : 0U;
    slot->image = image;
    return image;
}

void TextureCache::setRenderingColorSpace(const std::string& name) {
    const std::lock_guard lock(impl_->mutex);
    impl_->renderingSpace = name;
}

void TextureCache::releaseOthers(const std::set<ImageKey>& used) {
    const std::lock_guard lock(impl_->mutex);
    for (auto it = impl_->slots.begin(); it != impl_->slots.end();) {
        it = used.count(it->first) == 0 ? impl_->slots.erase(it) : std::next(it);
    }
}

void TextureCache::clear() {
    const std::lock_guard lock(impl_->mutex);
    impl_->slots.clear();
}

std::size_t TextureCache::bytes() const {
    std::size_t total = 0;
    for (const std::shared_ptr<const Image>& image : impl_->images()) {
        total += image->bytes();
    }
    return total;
}

std::uint64_t TextureCache::loaded() const {
    return impl_->loaded;
}

int TextureCache::count() const {
    return static_cast<int>(impl_->images().size());
}

} // namespace mbfeat
