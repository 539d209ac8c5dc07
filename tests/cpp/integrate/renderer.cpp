// The render thread: restart, stop, pause, two at once.
#include <chrono>
#include <thread>

#include <doctest/doctest.h>

#include "film/host.h"
#include "film/risingPass.h"
#include "testScenes.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// A job that takes far longer than a test.
RenderJob endlessJob() {
    RenderJob job;
    job.views.push_back(viewOf(testCamera({0, 0, 4}, 0.5F), 64, 64));
    job.options = exactOptions(1 << 24);
    return job;
}

struct Stage : TestScene {
    Stage() {
        add("/Ball", sphereMesh(1.0F, 16, false), constantMaterial("/M", Rgb(0.5F)));
        addSky(Rgb(1.0F));
    }
};

void waitForSamples(const Renderer& renderer) {
    while (renderer.progress().samples == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

} // namespace

TEST_CASE("a running render stops at once and can be started anew") {
    Stage stage;
    Renderer renderer(stage.scene);
    for (int i = 0; i < 3; ++i) {
        renderer.start(endlessJob());
        waitForSamples(renderer);
        const Clock::time_point begin = Clock::now();
        renderer.stop();
        // The aim is 50 ms for a restart; the margin is for a busy machine.
        CHECK(millisecondsSince(begin) < 500.0);
        CHECK_FALSE(renderer.isRendering());
        CHECK_FALSE(renderer.isConverged());
    }
}

TEST_CASE("a paused render makes no progress until it is resumed") {
    Stage stage;
    Renderer renderer(stage.scene);
    renderer.start(endlessJob());
    waitForSamples(renderer);
    renderer.pause();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const std::uint64_t before = renderer.progress().samples;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    CHECK(renderer.progress().samples == before);
    CHECK(renderer.isPaused());
    renderer.resume();
    const Clock::time_point begin = Clock::now();
    while (renderer.progress().samples == before && millisecondsSince(begin) < 5000.0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    CHECK(renderer.progress().samples > before);
    renderer.pause();
    renderer.stop(); // also stops while paused
    CHECK_FALSE(renderer.isRendering());
}

TEST_CASE("the finish call comes once, before convergence, and not after a stop") {
    Stage stage;
    Renderer renderer(stage.scene);
    RenderJob job = endlessJob();
    job.options.samplesPerPixel = 2;
    int calls = 0;
    bool convergedInside = true;
    job.finish = [&](RenderReport& report) {
        ++calls;
        convergedInside = renderer.isConverged();
        report.written.emplace_back("image.exr");
    };
    renderer.start(job);
    renderer.wait();
    CHECK(calls == 1);
    CHECK_FALSE(convergedInside);
    CHECK(renderer.isConverged());
    CHECK(renderer.report().written.size() == 1);
    CHECK(renderer.progress().fraction == doctest::Approx(1.0));

    job.options.samplesPerPixel = 1 << 24;
    renderer.start(job);
    waitForSamples(renderer);
    renderer.stop();
    CHECK(calls == 1);
}

TEST_CASE("waiting for a time ends with the time or with the job") {
    Stage stage;
    Renderer renderer(stage.scene);
    renderer.start(endlessJob());
    Clock::time_point begin = Clock::now();
    renderer.waitFor(std::chrono::milliseconds(20));
    CHECK(millisecondsSince(begin) >= 20.0);
    CHECK_FALSE(renderer.isConverged());
    RenderJob job = endlessJob();
    job.options.samplesPerPixel = 1;
    renderer.start(job);
    begin = Clock::now();
    renderer.waitFor(std::chrono::hours(1));
    CHECK(renderer.isConverged());
    CHECK(millisecondsSince(begin) < 60000.0);
}

TEST_CASE("two renderers live at once and one may die while rendering") {
    Stage first;
    Stage second;
    auto a = std::make_unique<Renderer>(first.scene);
    Renderer b(second.scene);
    a->start(endlessJob());
    b.start(endlessJob());
    waitForSamples(*a);
    waitForSamples(b);
    a.reset();
    const std::uint64_t before = b.progress().samples;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    CHECK(b.progress().samples > before);
    b.stop();
}

TEST_CASE("the host's request to stop ends a job as converged and interrupted") {
    Stage stage;
    Renderer renderer(stage.scene);
    RenderJob job = endlessJob();
    bool interrupted = false;
    job.finish = [&](RenderReport& report) { interrupted = report.interrupted; };
    renderer.start(job);
    waitForSamples(renderer);
    const Clock::time_point begin = Clock::now();
    Host::instance().requestStop();
    renderer.wait();
    CHECK(millisecondsSince(begin) < 1000.0);
    Host::instance().clearStop();
    CHECK(renderer.isConverged());
    CHECK(interrupted);
}

TEST_CASE("two who share a renderer and wait for their turn both get their images") {
    Stage stage;
    Renderer renderer(stage.scene);
    struct Client {
        RenderJob job;
        std::shared_ptr<const JobState> state;
        int starts = 0;
    };
    Client clients[2];
    for (Client& client : clients) {
        client.job = endlessJob();
        client.job.options.samplesPerPixel = 64;
    }
    const auto isDone = [](const Client& c) { return c.state && c.state->isConverged(); };
    const Clock::time_point begin = Clock::now();
    while (!(isDone(clients[0]) && isDone(clients[1])) && millisecondsSince(begin) < 20000.0) {
        for (Client& client : clients) {
            if (!client.state && renderer.isFreeFor(client.state.get())) {
                client.state = renderer.start(client.job);
                ++client.starts;
            }
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    for (const Client& client : clients) {
        CHECK(isDone(client)); // the first one still, after the second one's job
        CHECK(client.starts == 1);
        CHECK(client.job.views[0].film->sampleCount(31, 31) == 64);
    }
}

TEST_CASE("the state of a job tells whether it ran to its end") {
    Stage stage;
    Renderer renderer(stage.scene);
    CHECK(renderer.isFreeFor(nullptr));
    const auto state = renderer.start(endlessJob());
    CHECK(state->isRunning());
    CHECK(renderer.isFreeFor(state.get()));
    CHECK_FALSE(renderer.isFreeFor(nullptr));
    renderer.stop();
    CHECK_FALSE(state->isRunning());
    CHECK_FALSE(state->isConverged());
    CHECK(renderer.isFreeFor(nullptr));
    RenderJob job = endlessJob();
    job.options.samplesPerPixel = 1;
    const auto next = renderer.start(job);
    renderer.wait();
    CHECK(next->isConverged());
    CHECK_FALSE(state->isConverged());
}

TEST_CASE("a viewer's first pass has the whole image at reduced resolution first") {
    constexpr int kWidth = 2001, kHeight = 999; // no multiples of the coarsest stride
    Stage stage;
    Renderer renderer(stage.scene);
    FilmRequest request;
    request.window.width = kWidth + 7;
    request.window.height = kHeight + 5;
    request.window.data = {3, 5, kWidth, kHeight};
    RenderJob job = endlessJob();
    job.views.front().film = std::make_shared<Film>(request);
    job.interactive = true;
    const Film& film = *job.views.front().film;
    renderer.start(job);
    constexpr std::uint64_t kCoarse = std::uint64_t{(kWidth + 7) / 8} * ((kHeight + 7) / 8);
    while (renderer.progress().samples < kCoarse) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    renderer.stop();
    const std::vector<std::uint8_t> sampled = sampledPixels(film);
    int missing = 0;
    for (int y = 0; y < kHeight; y += 8) {
        for (int x = 0; x < kWidth; x += 8) {
            missing += sampled[static_cast<std::size_t>(y * kWidth + x)] == 0 ? 1 : 0;
        }
    }
    CHECK(missing == 0);
}

TEST_CASE("what a viewer gets is the image that others get at its splitting, bit for bit") {
    Stage stage;
    Renderer renderer(stage.scene);
    std::vector<std::vector<float>> images;
    for (const bool interactive : {false, true}) {
        FilmRequest request;
        request.window.width = 53;
        request.window.height = 37;
        request.window.data = {2, 1, 50, 33};
        RenderJob job = endlessJob();
        job.views.front().film = std::make_shared<Film>(request);
        job.options.samplesPerPixel = 5;
        job.interactive = interactive;
        const std::shared_ptr<Film> film = job.views.front().film;
        renderer.start(job);
        renderer.wait();
        for (const std::uint8_t there : sampledPixels(*film)) {
            REQUIRE(there == 1);
        }
        images.emplace_back(std::size_t{50} * 33 * 4);
        film->resolve(0, images.back().data());
    }
    CHECK(images[0] == images[1]);
}
