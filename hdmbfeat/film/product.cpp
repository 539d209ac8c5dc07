#include "film/product.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <system_error>
#include <thread>

#include <ImfThreading.h>

#include "film/exrHeader.h"
#include "film/exrLayout.h"
#include "film/exrWriter.h"

namespace mbfeat {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLongestLayer = 200; ///< EXR names end at 255, with channel and prefix

/// What messages about the product are about.
std::string subjectOf(const ProductSpec& product) {
    return product.primPath.empty() ? product.path : product.primPath;
}

/// "File F" or "Product P (file F)", to start a sentence with.
std::string title(const ProductSpec& product) {
    return product.primPath.empty()
               ? "Product file '" + product.path + "'"
               : "Product " + product.primPath + " (file '" + product.path + "')";
}

bool hasExrExtension(const fs::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension == ".exr";
}

/// The file that a write replaces: links are followed, so that they stay.
fs::path targetOf(const std::string& path) {
    std::error_code error;
    const fs::path resolved =
        fs::is_symlink(path, error) ? fs::weakly_canonical(path, error) : fs::path(path);
    return error || resolved.empty() ? fs::path(path) : resolved;
}

/// What keeps the file from being written, as the end of a sentence; empty if nothing does.
std::string pathProblem(const std::string& path) {
    if (path.empty()) {
        return "has no file name. Set productName";
    }
    if (!hasExrExtension(path)) {
        return "does not end in .exr, and only OpenEXR files are written. Rename it";
    }
    std::error_code error;
    const fs::path target = targetOf(path);
    if (fs::is_directory(target, error)) {
        return "is a directory. Choose another name";
    }
    const fs::path directory = target.has_parent_path() ? target.parent_path() : fs::path(".");
    if (!fs::exists(directory, error)) {
        return "lies in a directory that does not exist. Create '" + directory.string() + "'";
    }
    if (!fs::is_directory(directory, error)) {
        return "lies in '" + directory.string() + "', which is not a directory";
    }
    if (access(directory.c_str(), W_OK | X_OK) != 0) {
        return "lies in a directory that may not be written to. Change the permissions of '" +
               directory.string() + "' or choose another one";
    }
    return {};
}

std::string compressionProblem(const ProductSpec& product) {
    if (exrCompression(product.compression, product.deep)) {
        return {};
    }
    return "asks for the compression '" + product.compression + "', which " +
           (product.deep ? "deep files do not have. Use none, rle or zips"
                         : "does not exist. Use none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa "
                           "or dwab");
}

bool isWritableName(const std::string& layer) {
    return layer.size() <= kLongestLayer && std::none_of(layer.begin(), layer.end(), [](char c) {
               return static_cast<unsigned char>(c) < 0x20;
           });
}

/// Layers and channels that a file cannot hold.
std::vector<std::string> layerProblems(const ProductSpec& product) {
    std::vector<std::string> problems;
    const std::vector<ExrLayer> layers = exrLayers(product);
    if (layers.empty()) {
        problems.emplace_back("has no layers to write. Give it RenderVars that MBFeat knows");
    }
    std::map<std::string, std::string> layerAovs;
    std::map<std::string, std::string> channelLayers;
    for (const ExrLayer& layer : layers) {
        if (!isWritableName(layer.name)) {
            problems.push_back("has a layer whose name, for the AOV '" + layer.aov.name +
                               "', is longer than " + std::to_string(kLongestLayer) +
                               " bytes or holds control characters. Rename it");
            continue;
        }
        const auto [other, isNew] = layerAovs.emplace(layer.name, layer.aov.name);
        if (!isNew) {
            problems.push_back("has two layers named '" + layer.name + "', for the AOVs '" +
                               other->second + "' and '" + layer.aov.name +
                               "'. Give one of them another driver:parameters:aov:name");
            continue;
        }
        for (int c = 0; c < layer.aov.width(); ++c) {
            const auto [first, isFree] = channelLayers.emplace(layer.channel(c), layer.name);
            if (!isFree) {
                problems.push_back("has two channels named '" + layer.channel(c) +
                                   "', in the layers '" + first->second + "' and '" + layer.name +
                                   "'. Rename one of the layers");
            }
        }
    }
    return problems;
}

/// All that makes writing impossible.
std::vector<std::string> fatalProblems(const ProductSpec& product) {
    std::vector<std::string> problems;
    for (std::string problem : {pathProblem(product.path), compressionProblem(product)}) {
        if (!problem.empty()) {
            problems.push_back(std::move(problem));
        }
    }
    if (!product.deep) {
        for (std::string& problem : layerProblems(product)) {
            problems.push_back(std::move(problem));
        }
    }
    return problems;
}

/// What the film lacks for the product; empty if nothing.
std::string filmProblem(const ProductSpec& product, const Film& film) {
    if (product.deep) {
        return film.pathSamples() != nullptr ? std::string()
                                             : "is deep, but the film did not keep its paths";
    }
    for (const ExrLayer& layer : exrLayers(product)) {
        if (film.findBound(layer.aov.name) < 0) {
            return "needs the AOV '" + layer.aov.name + "', which the film did not record";
        }
    }
    return {};
}

int writerThreads(const RenderReport& report) {
    int threads = static_cast<int>(std::thread::hardware_concurrency());
    for (const Settings::Resolved& setting : report.settings) {
        const auto* const value = std::get_if<std::int64_t>(&setting.value);
        if (setting.name == "mbfeat:threads" && value != nullptr && *value > 0) {
            threads = static_cast<int>(std::min<std::int64_t>(*value, threads));
        }
    }
    // OpenEXR's pool belongs to the process. A host that set it up is left alone; an empty one does
    // all work on the calling thread, and growing it changes nobody's results.
    static std::once_flag once;
    std::call_once(once, [&] {
        if (Imf::globalThreadCount() == 0) {
            Imf::setGlobalThreadCount(threads);
        }
    });
    return threads;
}

/// A file beside the target that is gone when the scope ends, unless it replaced the target.
class TemporaryFile {
public:
    explicit TemporaryFile(fs::path target) : target_(std::move(target)) {
        static std::atomic<unsigned int> counter{0};
        path_ = target_;
        path_ += ".mbfeat-" + std::to_string(getpid()) + "-" + std::to_string(counter++) + ".tmp";
    }
    ~TemporaryFile() {
        if (!replaced_) {
            std::error_code ignored;
            fs::remove(path_, ignored);
        }
    }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    std::string path() const { return path_.string(); }
    void replaceTarget() {
        fs::rename(path_, target_);
        replaced_ = true;
    }

private:
    fs::path target_, path_;
    bool replaced_ = false;
};

/// Writes and renames; returns the number of clamped halves. Throws.
std::uint64_t writeFile(const ProductSpec& product, const Film& film, const RenderReport& report) {
    TemporaryFile temporary(targetOf(product.path));
    CheckedFileStream stream(temporary.path());
    const int threads = writerThreads(report);
    std::uint64_t clamped = 0;
    if (product.deep) {
        writeDeep(stream, product, film, report, threads);
    } else {
        clamped = writeRaster(stream, product, film, report, threads);
    }
    stream.close();
    temporary.replaceTarget();
    return clamped;
}

} // namespace

std::vector<Error> validateProduct(const ProductSpec& product) {
    std::vector<Error> errors;
    for (const std::string& problem : fatalProblems(product)) {
        errors.push_back(
            {subjectOf(product), title(product) + " " + problem + ". It is not written."});
    }
    for (const ProductLayer& layer : product.layers) {
        if (!findAov(layer.aov)) {
            errors.push_back(
                {subjectOf(product), title(product) + " asks for the AOV '" + layer.aov +
                                         "', which does not exist; did you mean '" +
                                         nearestAovName(layer.aov) + "'? Its layer is left out."});
        }
    }
    return errors;
}

Status writeProduct(const ProductSpec& product, const Film& film, const RenderReport& report,
                    Diagnostics* diagnostics) {
    std::vector<std::string> problems = fatalProblems(product);
    if (std::string problem = filmProblem(product, film); !problem.empty()) {
        problems.push_back(std::move(problem));
    }
    if (!problems.empty()) {
        return Error{subjectOf(product),
                     title(product) + " " + problems.front() + ". It was not written."};
    }
    try {
        const std::uint64_t clamped = writeFile(product, film, report);
        if (clamped > 0 && diagnostics != nullptr) {
            diagnostics->warn(subjectOf(product),
                              title(product) + ": " + std::to_string(clamped) +
                                  " values are too large for a half and were written as +-65504. "
                                  "Use float for these RenderVars to keep them.");
        }
        return std::nullopt;
    } catch (const std::exception& problem) {
        return Error{subjectOf(product), title(product) +
                                             " could not be written: " + problem.what() +
                                             ". Check the disk's space and the directory's "
                                             "permissions."};
    }
}

} // namespace mbfeat
