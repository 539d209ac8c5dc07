#include "denoise/model.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <optional>
#include <sstream>
#include <system_error>

#include "core/library.h"
#include "denoise/atrous.h"

namespace mbfeat {

namespace {

namespace fs = std::filesystem;

constexpr const char* kDefaultModel = "best";
constexpr int kFormat = 7;
constexpr int kOldestFormat = 2;   ///< had neither affinity nor demodulation
constexpr int kAffinityFormat = 3; ///< had no guides, and no passes after the splat
constexpr int kGuidesFormat = 4;   ///< had three classes, always
constexpr int kClassesFormat = 5;  ///< took any size

/// Where the models lie that MBFeat comes with.
fs::path modelFolder() {
    return fs::path(libraryFolder()) / ".." / "models";
}

/// A whole number within bounds; false where the text is something else.
bool readNumber(const std::string& text, int least, int most, int& value) {
    const char* const end = text.data() + text.size();
    const auto [last, failed] = std::from_chars(text.data(), end, value);
    return failed == std::errc() && last == end && value >= least && value <= most;
}

std::string listOfInstalled() {
    std::string list;
    for (const auto& [name, file] : DenoiseModel::installed()) {
        list += (list.empty() ? "" : ", ") + name;
    }
    return list.empty() ? "none" : list;
}

/// Decodes standard base64; nothing where it is not.
std::optional<std::string> decoded(const std::string& text) {
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3);
    unsigned bits = 0;
    int held = 0;
    for (const char c : text) {
        int digit = -1;
        if (c >= 'A' && c <= 'Z') {
            digit = c - 'A';
        } else if (c >= 'a' && c <= 'z') {
            digit = c - 'a' + 26;
        } else if (c >= '0' && c <= '9') {
            digit = c - '0' + 52;
        } else if (c == '+' || c == '/') {
            digit = c == '+' ? 62 : 63;
        } else if (c == '=') {
            break;
        }
        if (digit < 0) {
            return std::nullopt;
        }
        bits = (bits << 6U) | static_cast<unsigned>(digit);
        held += 6;
        if (held >= 8) {
            held -= 8;
            bytes.push_back(static_cast<char>((bits >> static_cast<unsigned>(held)) & 0xFFU));
        }
    }
    return bytes;
}

} // namespace

int DenoiseContract::spread() const {
    int sum = kernel / 2;
    for (const int dilation : atrous) {
        sum += atrous::kRadius * dilation;
    }
    return sum;
}

std::vector<std::pair<std::string, std::string>> DenoiseModel::installed() {
    std::vector<std::pair<std::string, std::string>> found;
    std::error_code ignored; // a folder that is not there holds no models
    for (const auto& entry : fs::directory_iterator(modelFolder(), ignored)) {
        if (entry.path().extension() == ".onnx") {
            found.emplace_back(entry.path().stem().string(), entry.path().string());
        }
    }
    std::sort(found.begin(), found.end());
    return found;
}

Result<std::shared_ptr<const DenoiseModel>> DenoiseModel::open(const std::string& name,
                                                               int threads) {
    std::string file = name;
    if (name.empty() ||
        (name.find('/') == std::string::npos && fs::path(name).extension().empty())) {
        file = (modelFolder() / ((name.empty() ? kDefaultModel : name) + std::string(".onnx")))
                   .string();
    }
    std::error_code problem;
    const auto changed = fs::last_write_time(file, problem);
    if (problem) {
        return Error{name.empty() ? kDefaultModel : name,
                     "the denoising network cannot be read (" + problem.message() +
                         "). Name an ONNX file, or one of those that MBFeat comes with: " +
                         listOfInstalled() + "."};
    }

    struct Kept {
        std::string file;
        fs::file_time_type changed;
        int threads;
        std::shared_ptr<const DenoiseModel> model;
    };
    static std::mutex mutex;
    // The one that was used last. Never destroyed: runtimes do not like to be torn down at exit.
    static auto& kept = *new Kept{};
    const std::lock_guard lock(mutex);
    if (kept.model && kept.file == file && kept.changed == changed && kept.threads == threads) {
        return kept.model;
    }
    Result<std::shared_ptr<const DenoiseModel>> model = read(file, threads);
    if (model) {
        kept = {file, changed, threads, model.value()};
    }
    return model;
}

Result<std::shared_ptr<const DenoiseModel>> DenoiseModel::read(const std::string& file,
                                                               int threads) {
    const auto runtime = OnnxRuntime::instance();
    if (!runtime) {
        return runtime.error();
    }
    std::ifstream stream(file, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(stream)),
                            std::istreambuf_iterator<char>());
    if (!stream && bytes.empty()) {
        return Error{file, "it cannot be read. Check its permissions."};
    }
    std::shared_ptr<DenoiseModel> model(new DenoiseModel);
    model->file_ = file;
    auto graph = OnnxSession::open(runtime.value(), bytes, file, threads);
    if (!graph) {
        return graph.error();
    }
    model->graph_ = std::move(graph.value());
    if (const Status failed = model->readContract()) {
        return *failed;
    }
    if (model->contract_.kind == DenoiseContract::Kind::kLayered) {
        const auto samples = decoded(model->graph_->metadata("mbfeat:samples"));
        if (!samples) {
            return Error{file, "the part of the network that reads samples is damaged. Export it "
                               "anew."};
        }
        auto sampleGraph = OnnxSession::open(runtime.value(), *samples, file, 1);
        if (!sampleGraph) {
            return sampleGraph.error();
        }
        model->sampleGraph_ = std::move(sampleGraph.value());
        if (const Status failed = model->readEncoder()) {
            return *failed;
        }
    }
    if (const Status failed = model->checkGraphs()) {
        return *failed;
    }
    return std::shared_ptr<const DenoiseModel>(std::move(model));
}

Status DenoiseModel::readContract() {
    const auto entry = [&](const char* name) {
        return graph_->metadata(std::string("mbfeat:") + name);
    };
    if (!readNumber(entry("format"), kOldestFormat, kFormat, contract_.format)) {
        return Error{file_, entry("format").empty()
                                ? "it is no network of MBFeat's: its metadata lacks mbfeat:format. "
                                  "Give a file that training.export wrote."
                                : "its format " + entry("format") +
                                      " is none of those that this version reads, " +
                                      std::to_string(kOldestFormat) + " to " +
                                      std::to_string(kFormat) +
                                      ". Export it with training.export of this version, or "
                                      "update MBFeat where the network is newer."};
    }
    const std::string kind = entry("kind");
    if (kind != "hidden" && kind != "layered") {
        return Error{file_, "a network of kind " + kind +
                                " is made for comparisons, not for "
                                "rendering. Export it without --whole."};
    }
    contract_.kind =
        kind == "layered" ? DenoiseContract::Kind::kLayered : DenoiseContract::Kind::kHidden;
    contract_.features = entry("features");
    std::istringstream list(entry("channels"));
    for (std::string channel; std::getline(list, channel, ',');) {
        contract_.channels.push_back(channel);
    }
    struct Number {
        const char* name;
        int* value;
        int least, most;
        int since = kOldestFormat; ///< in formats before it was 0
    };
    for (const Number& number :
         {Number{"kernel", &contract_.kernel, 1, 99}, Number{"unit", &contract_.unit, 1, 1024},
          Number{"affinity", &contract_.affinity, 0, 256, kAffinityFormat},
          Number{"guides", &contract_.guides, 0, guides::kCount, kGuidesFormat},
          Number{"demodulated", &contract_.demodulated, 0, 1, kAffinityFormat},
          Number{"receptiveField", &contract_.receptiveField, 0, 4096},
          Number{"classPlanes", &contract_.classPlanes, 0, 1 << 16},
          Number{"workingFloats", &contract_.workingFloats, 1, 1 << 20}}) {
        const bool isMissing = contract_.format < number.since;
        const std::string text = isMissing ? "0" : entry(number.name);
        if (!readNumber(text, number.least, number.most, *number.value)) {
            return Error{file_, "its metadata mbfeat:" + std::string(number.name) + " is '" + text +
                                    "', which cannot be. Export the network anew."};
        }
    }
    contract_.wholeUnits = contract_.format > kClassesFormat;
    const bool layered = contract_.kind == DenoiseContract::Kind::kLayered;
    if (layered && contract_.format > kGuidesFormat &&
        (!readNumber(entry("classes"), 1, 3, contract_.classes) || contract_.classes == 2)) {
        return Error{file_, "its metadata mbfeat:classes is '" + entry("classes") +
                                "', which cannot be. Export the network anew."};
    }
    // Of one class with guides these and a count by the way to their vertex, else a count at least.
    const int least = contract_.classes == 1 && contract_.guides > 0
                          ? kPathWays * (contract_.guides + 1)
                          : contract_.guides + 1;
    if (layered && contract_.classPlanes < least) {
        return Error{file_, "its metadata mbfeat:classPlanes is '" + entry("classPlanes") +
                                "', which cannot be with its guides and classes. Export the "
                                "network anew."};
    }
    std::istringstream dilations(entry("atrous"));
    for (std::string text; std::getline(dilations, text, ',');) {
        if (!readNumber(text, 1, 1024, contract_.atrous.emplace_back())) {
            return Error{file_, "its metadata mbfeat:atrous is '" + entry("atrous") +
                                    "', which cannot be. Export the network anew."};
        }
    }
    if (contract_.kernel % 2 == 0 || (contract_.affinity == 0 && !contract_.atrous.empty()) ||
        (contract_.guides != 0 && !guides::isCount(contract_.guides)) ||
        contract_.guides > contract_.affinity || contract_.channels.size() < 3 ||
        contract_.channels[0] != "R") {
        return Error{file_, "its metadata contradicts itself (kernel " +
                                std::to_string(contract_.kernel) + ", " +
                                std::to_string(contract_.channels.size()) +
                                " channels). Export the network anew."};
    }
    return std::nullopt;
}

Status DenoiseModel::readEncoder() {
    const std::string text = graph_->metadata("mbfeat:encoder");
    if (text.empty()) {
        return std::nullopt;
    }
    if (const auto bytes = decoded(text)) {
        encoder_ = PathEncoder::read(*bytes, contract_.format > kAffinityFormat);
    }
    if (encoder_) {
        encoder_->hasWays = contract_.classes == 1 && encoder_->guides > 0;
    }
    if (!encoder_ || encoder_->planes() != contract_.classPlanes ||
        contract_.channels.size() != extended::kChannels) {
        return Error{file_, "the weights of its encoder are damaged. Export the network anew."};
    }
    return std::nullopt;
}

Status DenoiseModel::checkGraphs() const {
    using Names = std::vector<std::string>;
    const bool layered = contract_.kind == DenoiseContract::Kind::kLayered;
    Names outputs = {"hidden", "weight", "bias"};
    if (contract_.affinity > 0) {
        outputs.emplace_back("alike");
    }
    if (contract_.guides > 0) {
        outputs.emplace_back("scales");
    }
    if (!contract_.atrous.empty()) {
        outputs.insert(outputs.end(), {"centre", "table"});
    }
    Names sums = {"classes", "mask"};
    if (contract_.demodulated != 0) {
        outputs.emplace_back("gate");
        sums.emplace_back("divisor");
    }
    const bool right =
        graph_->outputs() == outputs &&
        (layered ? graph_->inputs() == Names{"classes"} &&
                       sampleGraph_->inputs() == Names{"samples", "share"} &&
                       sampleGraph_->outputs() == sums
                 : graph_->inputs() == Names{"samples", "share"} && outputs.size() == 3);
    if (!right) {
        return Error{file_, "its inputs and outputs are not those of its kind. Export the network "
                            "anew."};
    }
    return std::nullopt;
}

} // namespace mbfeat
