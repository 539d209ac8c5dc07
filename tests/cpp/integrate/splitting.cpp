// Paths that become several at their first wide scattering.
#include "integrate/splitting.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/check.h"
#include "testScenes.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

constexpr int kSide = 12;

/// A room whose ceiling a lamp shines at, seen through panes: nearly all light is indirect, and it
/// takes several rays to get to where it matters.
void fillRoom(TestScene& test) {
    const Material wall = constantMaterial("/M/Wall", {0.8F, 0.7F, 0.6F});
    test.add("/Floor", quadMesh({-3, -1, -6}, {6, 0, 0}, {0, 0, 8}), wall);
    test.add("/Ceiling", quadMesh({-3, 3, -6}, {6, 0, 0}, {0, 0, 8}), wall);
    test.add("/Back", quadMesh({-3, -1, -6}, {6, 0, 0}, {0, 4, 0}), wall);
    Material glass = constantMaterial("/M/Glass", {1.0F, 1.0F, 1.0F});
    glass.opacity = MaterialInput(0.0F);
    glass.roughness = MaterialInput(0.0F);
    for (int pane = 0; pane < 6; ++pane) {
        test.add("/Pane" + std::to_string(pane),
                 quadMesh({-3, -1, 1.0F - 0.1F * static_cast<float>(pane)}, {6, 0, 0}, {0, 4, 0}),
                 glass);
    }
    test.add("/Front", quadMesh({-3, -1, 2}, {6, 0, 0}, {0, 4, 0}), wall);
    test.add("/Left", quadMesh({-3, -1, -6}, {0, 0, 8}, {0, 4, 0}), wall);
    test.add("/Right", quadMesh({3, -1, -6}, {0, 0, 8}, {0, 4, 0}), wall);
    Light lamp;
    lamp.path = "/Lamp";
    lamp.type = LightType::kRect;
    lamp.radiance = Rgb(6.0F);
    lamp.toWorld.x = {2.0, 0.0, 0.0};
    lamp.toWorld.y = {0.0, 0.0, 2.0};
    lamp.toWorld.z = {0.0, -1.0, 0.0};
    lamp.toWorld.t = {0.0, 2.0, -2.5};
    test.scene.setLight(lamp);
}

/// Open ground under a small bright light: nearly all light is direct.
void fillField(TestScene& test) {
    test.add("/Ground", quadMesh({-50, -1, -50}, {100, 0, 0}, {0, 0, 100}),
             constantMaterial("/M/Ground", {0.2F, 0.2F, 0.2F}));
    test.addLamp(1.0);
}

/// So many samples that an image of kSide pixels a side is worth a trial.
constexpr int kWorthwhile = 200;

/// What the view of a request comes to split into.
int branchesOf(TestScene& test, const IntegratorRequest& request, int side = kSide) {
    Integrator integrator(test.scene);
    prepareView(integrator, request, testCamera({0, 0.5, 1.5}, 0.7F), side, side);
    CHECK(integrator.statistics().rays == 0); // trials are not the image's
    return integrator.kernel().branches;
}

IntegratorRequest fitted(int samples, Kernel kernel = Kernel::kAuto, std::uint64_t seed = 5) {
    IntegratorRequest request;
    request.options = exactOptions(samples);
    request.options.maxBounces = 8;
    request.options.splitting = kFittedSplitting;
    request.options.kernel = kernel;
    request.options.seed = seed;
    return request;
}

struct Estimate {
    std::vector<double> mean, variance; ///< of a sample, by pixel and colour
    int branches = 0;
};

/// Of every pixel's samples.
Estimate estimate(TestScene& test, int splitting, std::uint32_t samples,
                  Kernel kernel = Kernel::kAuto, std::uint64_t seed = 5) {
    Integrator integrator(test.scene);
    IntegratorRequest request;
    request.options = exactOptions(static_cast<int>(samples));
    request.options.maxBounces = 8;
    request.options.splitting = splitting;
    request.options.kernel = kernel;
    request.options.seed = seed;
    prepareView(integrator, request, testCamera({0, 0.5, 1.5}, 0.7F), kSide, kSide);
    Estimate found;
    found.branches = integrator.kernel().branches;
    const std::unique_ptr<PathWorker> worker = integrator.makeWorker();
    for (int pixel = 0; pixel < kSide * kSide; ++pixel) {
        std::vector<PixelSample> of;
        for (std::uint32_t s = 0; s < samples; ++s) {
            of.push_back({pixel % kSide, pixel / kSide, s});
        }
        double sums[3] = {}, squares[3] = {};
        for (std::size_t first = 0; first < of.size(); first += 128) {
            const std::size_t count = std::min<std::size_t>(128, of.size() - first);
            REQUIRE(integrator.trace(*worker, of.data() + first, static_cast<int>(count), {}));
            for (std::size_t i = 0; i < count; ++i) {
                for (int c = 0; c < 3; ++c) {
                    const double value = static_cast<double>(worker->records()[i].radiance[c]);
                    sums[c] += value;
                    squares[c] += value * value;
                }
            }
        }
        for (int c = 0; c < 3; ++c) {
            const double mean = sums[c] / samples;
            found.mean.push_back(mean);
            found.variance.push_back(squares[c] / samples - mean * mean);
        }
    }
    return found;
}

double total(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) {
        sum += value;
    }
    return sum;
}

} // namespace

TEST_CASE("splitting changes no pixel's mean, and takes noise from indirect light") {
    TestScene test;
    fillRoom(test);
    constexpr std::uint32_t kSamples = 512;
    const Estimate whole = estimate(test, 1, kSamples);
    for (const int branches : {2, 4}) {
        CAPTURE(branches);
        const Estimate split = estimate(test, branches, kSamples, Kernel::kAuto, 6);
        CHECK(split.branches == branches);
        // Stratified samples are less noisy than their own spread tells: z is on the safe side. 2.4
        // standard deviations of chi-squared over 144 independent pixels: a false alarm in a
        // hundred seeds, and the seeds are fixed.
        double chi = 0.0;
        for (std::size_t i = 0; i < whole.mean.size(); i += 3) {
            const double error = (whole.variance[i] + split.variance[i]) / kSamples;
            chi += (whole.mean[i] - split.mean[i]) * (whole.mean[i] - split.mean[i]) /
                   std::max(error, 1e-12);
        }
        const double pixels = kSide * kSide;
        CHECK(chi < pixels + 2.4 * std::sqrt(2.0 * pixels));
        CHECK(isNear(total(split.mean), total(whole.mean), 0.01));
        CHECK(total(split.variance) < 1.5 / branches * total(whole.variance));
    }
}

TEST_CASE("branches that leave by a mirror-like lobe do not split again") {
    // Between coated walls most branches are reflected by the coats, vertex after vertex.
    TestScene test;
    Material coated = constantMaterial("/M/Coated", {0.8F, 0.8F, 0.8F});
    coated.clearcoat = MaterialInput(1.0F);
    coated.clearcoatRoughness = MaterialInput(0.0F);
    coated.ior = MaterialInput(8.0F);
    coated.roughness = MaterialInput(0.0F);
    test.add("/Room", sphereMesh(3.0F, 24, true), coated);
    test.addLamp(1.0);
    const Estimate whole = estimate(test, 1, 512);
    const Estimate split = estimate(test, 4, 512, Kernel::kAuto, 6);
    // Two and a half standard deviations: a false alarm in eighty seeds, and the seeds are fixed.
    CHECK(isNear(total(split.mean), total(whole.mean), 0.03));
}

TEST_CASE("whether paths split is as it pays, and as the setting says") {
    TestScene room, field;
    fillRoom(room);
    fillField(field);
    for (const Kernel kernel : {Kernel::kScalar, Kernel::kAvx2, Kernel::kAuto}) {
        for (std::uint64_t seed = 0; seed < 3; ++seed) {
            CHECK(branchesOf(room, fitted(kWorthwhile, kernel, seed)) == 4);
            CHECK(branchesOf(field, fitted(kWorthwhile, kernel, seed)) == 1);
        }
    }
    CHECK(estimate(field, 3, 1).branches == 3);
    CHECK(estimate(room, 1, 1).branches == 1);
}

TEST_CASE("where a trial would be much of the work, or be stopped, paths stay whole") {
    TestScene room;
    fillRoom(room);
    CHECK(branchesOf(room, fitted(100)) == 1);
    IntegratorRequest stopped = fitted(kWorthwhile);
    stopped.stop = [] { return true; };
    CHECK(branchesOf(room, stopped) == 1);
    IntegratorRequest single = fitted(kWorthwhile);
    single.options.maxBounces = 1;
    CHECK(branchesOf(room, single) == 1);
}

TEST_CASE("a view that may end early splits as its least samples and its target ask for") {
    constexpr int kLeast = 16, kLarge = 48; // 36,864 samples at least
    TestScene room;
    fillRoom(room);
    IntegratorRequest request = fitted(kWorthwhile);
    request.leastSamples = request.targetSamples = kLeast;
    CHECK(branchesOf(room, request) == 1); // 2,304 samples may be all
    CHECK(branchesOf(room, request, kLarge) == 4);
    request.options.targetError = 0.001; // thousands of samples
    CHECK(branchesOf(room, request, kLarge) == 4);
    request.options.targetError = 10.0; // reached as soon as it is looked at
    CHECK(branchesOf(room, request, kLarge) == 1);
    request.leastSamples = 1; // whatever the target, the time may be up
    CHECK(branchesOf(room, request, kLarge) == 1);
    request.options.targetError = 0.0;
    CHECK(branchesOf(room, request, kLarge) == 1);
    request.leastSamples = 1000; // more than all
    CHECK(branchesOf(room, request) == 4);

    TestScene empty; // where two paths for one take no more rays
    empty.addLamp(1.0);
    request.options.targetError = 0.1;
    CHECK(branchesOf(empty, request) == 1);
}

TEST_CASE("a render with a loose target keeps paths whole, and says what it did") {
    TestScene room;
    fillRoom(room);
    RenderOptions options = fitted(kWorthwhile).options;
    const RenderView view = viewOf(testCamera({0, 0.5, 1.5}, 0.7F), 48, 48);
    options.targetError = 10.0;
    CHECK(renderView(room.scene, view, options).branches == std::vector<int>{1});
    options.targetError = 0.0;
    options.timeLimit = 0.001; // after a sample of each pixel
    CHECK(renderView(room.scene, view, options).branches == std::vector<int>{1});
    options.targetError = 0.001;
    CHECK(renderView(room.scene, view, options).branches == std::vector<int>{1});
    options.timeLimit = 0.0;
    options.samplesPerPixel = 16;
    CHECK(renderView(room.scene, view, options).branches == std::vector<int>{4});
}

TEST_CASE("paths that are recorded or clamped stay whole, which is said where it is not meant") {
    const auto isTold = [](const TestScene& room) {
        const std::vector<Message> messages = room.diagnostics.messages();
        return std::any_of(messages.begin(), messages.end(), [](const Message& message) {
            return message.subject == "mbfeat:splitting" &&
                   message.text.find("is 1 for this view, not 4") != std::string::npos;
        });
    };
    const auto clampDirect = [](IntegratorRequest& r) { r.options.clampDirect = 2.0F; };
    const auto clampIndirect = [](IntegratorRequest& r) { r.options.clampIndirect = 2.0F; };
    const auto contributions = [](IntegratorRequest& r) { r.recordFlags = kRecordContributions; };
    const auto features = [](IntegratorRequest& r) { r.recordFlags = kRecordFeatures; };
    const auto firstHit = [](IntegratorRequest& r) { r.recordFlags = kRecordFirstHit; };
    using Change = void (*)(IntegratorRequest&);
    for (const Change change :
         {Change(clampDirect), Change(clampIndirect), Change(contributions), Change(features)}) {
        TestScene room;
        fillRoom(room);
        IntegratorRequest request = fitted(kWorthwhile);
        change(request);
        CHECK(branchesOf(room, request) == 1);
        CHECK_FALSE(isTold(room)); // nobody asked for branches
        request.options.splitting = 4;
        CHECK(branchesOf(room, request) == 1);
        CHECK(isTold(room));
    }
    TestScene room;
    fillRoom(room);
    IntegratorRequest request = fitted(kWorthwhile);
    firstHit(request);
    CHECK(branchesOf(room, request) == 4);
}

TEST_CASE("a viewer does not try out whether paths split") {
    TestScene room;
    fillRoom(room);
    const RenderOptions options = fitted(kWorthwhile).options;
    const RenderView view = viewOf(testCamera({0, 0.5, 1.5}, 0.7F), kSide, kSide);
    CHECK(renderView(room.scene, view, options).kernel.branches == 4);
    CHECK(renderView(room.scene, view, options, true).kernel.branches == 1);
}

TEST_CASE("a batch that is stopped leaves nothing of its branches behind") {
    TestScene test;
    fillRoom(test);
    Integrator integrator(test.scene);
    IntegratorRequest request;
    request.options = exactOptions(1);
    request.options.splitting = 2;
    prepareView(integrator, request, testCamera({0, 0.5, 1.5}, 0.7F), kSide, kSide);
    const std::unique_ptr<PathWorker> fresh = integrator.makeWorker();
    const std::unique_ptr<PathWorker> stopped = integrator.makeWorker();
    std::vector<PixelSample> samples;
    for (std::uint32_t s = 0; s < 100; ++s) {
        samples.push_back({3, 4, s});
    }
    int polls = 0;
    REQUIRE_FALSE(integrator.trace(*stopped, samples.data(), 100, [&] { return ++polls > 2; }));
    REQUIRE(integrator.trace(*stopped, samples.data(), 100, {}));
    REQUIRE(integrator.trace(*fresh, samples.data(), 100, {}));
    double sum = 0.0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        CHECK(stopped->records()[i].radiance.x == fresh->records()[i].radiance.x);
        sum += static_cast<double>(fresh->records()[i].radiance.x);
    }
    CHECK(sum > 0.0);
}

TEST_CASE("a part of an image splits as the whole does") {
    TestScene test;
    fillRoom(test);
    Integrator integrator(test.scene);
    const IntegratorRequest request = fitted(kWorthwhile);
    REQUIRE(integrator.commit(request.options, {}));
    ImageWindow window;
    window.width = window.height = kSide;
    window.data = {0, 0, 1, 1};
    REQUIRE_FALSE(integrator.setView(testCamera({0, 0.5, 1.5}, 0.7F), window, request));
    CHECK(integrator.kernel().branches == 4);
}
