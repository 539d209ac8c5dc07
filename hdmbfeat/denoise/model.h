// A trained network as it is exported by training/export.py: its graphs, and what a program has to
// know of them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "denoise/onnxRuntime.h"
#include "denoise/pathEncoder.h"

namespace mbfeat {

/// What the model file's metadata says (entries "mbfeat:kind" and so on).
struct DenoiseContract {
    /// `hidden`: one graph from the samples of a tile to hidden features of every sample.
    /// `layered`: a graph that sums samples up by class, pixel by pixel, and one from these sums to
    /// hidden features of the classes.
    enum class Kind : std::uint8_t { kHidden, kLayered };
    Kind kind = Kind::kHidden;
    int format = 0;
    std::string features;              ///< gbuffer, paths or extended
    std::vector<std::string> channels; ///< of a sample, in the network's order
    int kernel = 1;
    int unit = 1;            ///< tiles begin at multiples of this
    bool wholeUnits = false; ///< the graph's sizes are multiples of it too, filled with zeros
    int receptiveField = 0;  ///< pixels around one that can change it, without the splat
    int classPlanes = 0;     ///< of a layered model: sums of a class
    int classes = 3;         ///< of a layered model: direct, reflected, transmitted; or 1, all,
                             ///< whose guides are summed up by their ways, see pathEncoder.h
    int affinity = 0;        ///< of a layered model: channels of `alike`, see splat.h
    int guides = 0;          ///< of a layered model: how many of these are guides, see splat.h
    std::vector<int> atrous; ///< of a layered model: dilations of the passes after the splat
    int demodulated = 0;     ///< of a layered model: 1 where divided radiance is splatted too
    int workingFloats = 0;   ///< a pixel, at its largest, of a run; of `hidden`, a sample and pixel

    /// Pixels that light moves at most from its own, the splat and the passes after it.
    int spread() const;
};

/// A model that is ready to run. Any thread.
class DenoiseModel {
public:
    /// `name` is an ONNX file, or the name of one that MBFeat comes with; empty is the default one.
    /// Models are kept, so that the next frame opens nothing; a file that has changed is read anew.
    static Result<std::shared_ptr<const DenoiseModel>> open(const std::string& name, int threads);

    /// Names and files of the models that MBFeat comes with.
    static std::vector<std::pair<std::string, std::string>> installed();

    const std::string& file() const { return file_; }
    const DenoiseContract& contract() const { return contract_; }
    /// Runs whole tiles, on all threads.
    const OnnxSession& graph() const { return *graph_; }
    /// Of a layered model: sums up samples, one thread a run.
    const OnnxSession& sampleGraph() const { return *sampleGraph_; }
    /// The same written out, where the network is one of those that have it; else null.
    const PathEncoder* encoder() const { return encoder_ ? &*encoder_ : nullptr; }

private:
    DenoiseModel() = default;
    static Result<std::shared_ptr<const DenoiseModel>> read(const std::string& file, int threads);
    Status readContract();
    Status readEncoder();
    Status checkGraphs() const;

    std::string file_;
    DenoiseContract contract_;
    std::unique_ptr<OnnxSession> graph_, sampleGraph_;
    std::optional<PathEncoder> encoder_;
};

} // namespace mbfeat
