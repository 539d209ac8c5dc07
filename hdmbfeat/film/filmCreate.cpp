// Films for requests that come from a user: everything that can be wrong with one is an error.
#include <cstdio>
#include <new>
#include <optional>
#include <unordered_set>
#include <utility>

#include "film/film.h"
#include "film/filmDenoiser.h"

namespace mbfeat {

namespace {

/// What is wrong with the request, but for its size.
Status checkRequest(const FilmRequest& request) {
    if (request.window.data.width <= 0 || request.window.data.height <= 0) {
        return Error{"film", "The data window is empty, so there is nothing to render. Check the "
                             "resolution and dataWindowNDC."};
    }
    std::unordered_set<std::string> names;
    int primvarCount = 0;
    for (const std::string& name : request.aovs) {
        const std::optional<AovDescriptor> aov = findAov(name);
        if (!aov) {
            return Error{name, "There is no AOV of this name; did you mean '" +
                                   nearestAovName(name) + "'?"};
        }
        if (!names.insert(name).second) {
            return Error{name, "The AOV is bound twice. Bind each AOV once."};
        }
        primvarCount += (aov->recordFlags & kRecordPrimvars) != 0 ? 1 : 0;
    }
    if (primvarCount > kMaxPrimvarAovs) {
        return Error{"primvars:*", std::to_string(primvarCount) +
                                       " primvar AOVs are bound, but only " +
                                       std::to_string(kMaxPrimvarAovs) +
                                       " can be recorded at once. Bind fewer, or render twice."};
    }
    return std::nullopt;
}

std::string gibibytes(double bytes) {
    char text[32];
    std::snprintf(text, sizeof(text), "%.3g GiB", bytes / (1024.0 * 1024.0 * 1024.0));
    return text;
}

} // namespace

Result<std::shared_ptr<Film>> Film::create(const FilmRequest& request,
                                           std::size_t pathSampleLimit) {
    if (Status problem = checkRequest(request)) {
        return *std::move(problem);
    }
    // In double: the product of a hostile resolution and sample count overflows integers.
    const double pixels = static_cast<double>(request.window.data.width) *
                          static_cast<double>(request.window.data.height);
    const bool keepsForDenoiser = request.denoise && request.denoise->keepsPaths();
    if (request.keepPathSamples || keepsForDenoiser) {
        const auto fields = static_cast<double>(
            pathSampleFields(request.extendedPathSamples || keepsForDenoiser).size());
        const double needed = pixels * request.samplesPerPixel * fields * sizeof(float);
        if (needed > static_cast<double>(pathSampleLimit)) {
            return Error{"mbfeat:pathSampleMemory",
                         "Keeping every path of this frame takes " + gibibytes(needed) +
                             ", more than the limit of " +
                             gibibytes(static_cast<double>(pathSampleLimit)) +
                             ". Raise mbfeat:pathSampleMemory, or render a smaller data window or "
                             "fewer samples per pixel."};
        }
    }
    try {
        std::unique_ptr<FilmDenoiser> denoiser;
        if (request.denoise) {
            Result<std::unique_ptr<FilmDenoiser>> made =
                FilmDenoiser::make(request.denoise, request.window, request.aovs);
            if (!made) {
                return made.error();
            }
            denoiser = std::move(made.value());
        }
        return std::make_shared<Film>(request, std::move(denoiser));
    } catch (const std::bad_alloc&) {
        return Error{"film", "There is not enough memory for the accumulators of " +
                                 std::to_string(request.window.data.width) + " x " +
                                 std::to_string(request.window.data.height) +
                                 " pixels. Render fewer AOVs or a smaller data window."};
    }
}

} // namespace mbfeat
