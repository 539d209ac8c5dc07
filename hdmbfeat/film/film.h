// The film: adds path records up, per pixel and per AOV, and optionally keeps every path.
//
// Sums are in double and in sample order, so a pixel's value depends on its samples only.
// Threads: add() may run for different pixels at once, and resolve() and sampleCount() beside it
// and beside clear(): they see whole samples of each pixel, of different pixels at different times.
// Kept paths are to be read after the render.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/affine.h"
#include "core/diagnostics.h"
#include "film/aovTable.h"
#include "integrate/pathRecord.h"
#include "scene/camera.h"

namespace mbfeat {

/// Layout of one kept path: named float fields in order, see pathSampleFields().
struct PathSampleField {
    std::string name; ///< EXR channel name: "R", "Z", "subpixel.X", "mbfeat:albedo:0.R", ...
    bool isInteger = false;
};

/// RGBA, Z (first-hit distance), subpixel x and y, the valid mask, the 54 features, and with
/// `extended` the extended set, both in the order of the AOV table.
std::vector<PathSampleField> pathSampleFields(bool extended);

struct FilmDenoise;
class FilmDenoiser;
struct PixelSample;

struct FilmRequest {
    ImageWindow window;
    std::vector<std::string> aovs; ///< distinct, all known to findAov(); `color` is always kept
    bool keepPathSamples = false;
    bool extendedPathSamples = false;
    int samplesPerPixel = 0;              ///< capacity of the path sample store
    std::optional<AffineD> cameraToWorld; ///< for headers
    /// Null: nothing is reconstructed.
    std::shared_ptr<const FilmDenoise> denoise;
};

class Film {
public:
    /// Unknown and repeated AOVs are left out. Throws std::bad_alloc where memory is short, which
    /// only callers that made the request themselves should risk: others use create().
    /// Nothing is denoised, whatever the request says: that is up to create().
    explicit Film(const FilmRequest& request);
    Film(const FilmRequest& request, std::unique_ptr<FilmDenoiser> denoiser);
    ~Film();
    Film(const Film&) = delete;
    Film& operator=(const Film&) = delete;

    /// A film for a request that comes from a user: an error names an unknown or repeated AOV, more
    /// than kMaxPrimvarAovs primvars, an empty window, kept paths that take more than
    /// `pathSampleLimit` bytes, or memory that the system does not have.
    static Result<std::shared_ptr<Film>> create(const FilmRequest& request,
                                                std::size_t pathSampleLimit);

    const ImageWindow& window() const;
    /// RecordFlags that the bound AOVs and kept samples need.
    std::uint32_t recordFlags() const;
    const std::optional<AffineD>& cameraToWorld() const;
    /// Primvar names behind primvars:* AOVs, in slot order of PathRecord::primvars.
    const std::vector<std::string>& primvars() const;
    const std::vector<AovDescriptor>& aovs() const; ///< bound ones; index 0 is `color`

    /// Adds samples of pixel (x, y), display-window coordinates inside the data window. Samples of
    /// a pixel are added in sample order, by one thread at a time.
    void add(int x, int y, ConstPathRecords records, int count);
    void add(int x, int y, const PathRecord& record) { add(x, y, &record, 1); }
    /// Gives the denoiser, if there is one, a batch that was added; as add() for threads. The paths
    /// of a pixel lie side by side.
    void addToDenoiser(const PixelSample* batch, ConstPathRecords records, int count);
    /// Reconstructs `color`, and what adds up to it, from all samples; from then on they resolve to
    /// that. An error leaves them as they are; without a denoiser, or when `stop` ended it, they
    /// are too. After the last add(), beside resolve().
    Status reconstruct(const std::atomic<bool>* stop);
    /// Null where nothing is denoised.
    const FilmDenoiser* denoiser() const;
    /// Forgets all samples.
    void clear();
    /// Samples added to that pixel.
    std::uint32_t sampleCount(int x, int y) const;

    /// Writes the AOV's current value as float32 (kInt AOVs: as int32 bit patterns through
    /// resolveInt), row 0 at the top, width() values a pixel, data-window size. resolve() of a kInt
    /// AOV gives its values as floats, resolveInt() of a kFloat one rounds towards zero.
    void resolve(int aovIndex, float* out) const;
    void resolveInt(int aovIndex, std::int32_t* out) const;
    /// Index into aovs(), or -1.
    int findBound(const std::string& name) const;

    /// Kept paths: float[height][width][samplesPerPixel][fields] of the data window; integers as
    /// their values, zeros where a sample was not added yet. Null when not kept.
    const float* pathSamples() const;
    int pathSampleCapacity() const;
    const std::vector<PathSampleField>& pathSampleLayout() const;

    std::size_t bytes() const;

private:
    friend class FilmRow;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// A copy of one row of a film, for those that resolve many AOVs: pixel by pixel they would come
/// back to the same memory again and again. The film must outlive it.
class FilmRow {
public:
    explicit FilmRow(const Film& film);

    /// Copies row `row` of the data window, as it is at that moment.
    void read(int row);
    /// As Film::resolve() and Film::resolveInt(), of that row.
    void resolve(int aovIndex, float* out) const;
    void resolveInt(int aovIndex, std::int32_t* out) const;

private:
    template <class T>
    void resolveTo(int aovIndex, T* out) const;
    template <int Width>
    void resolveMeans(const AovDescriptor& aov, int slot, float* out) const;

    const Film::Impl& film_;
    int row_ = 0; ///< the one that was read
    std::vector<std::uint32_t> counts_;
    std::vector<double> sums_;
    std::vector<std::uint32_t> words_;
};

} // namespace mbfeat
