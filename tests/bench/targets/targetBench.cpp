// Renders a small room to a fixed number of samples, so that its instructions can be counted:
// valgrind --tool=callgrind targetBench SAMPLES
#define DOCTEST_CONFIG_IMPLEMENT
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <utility>

#include <doctest/doctest.h>

#include "film/renderer.h"
#include "integrate/testScenes.h"

using namespace mbfeat;
using namespace mbfeat::test;

namespace {

constexpr int kSide = 24;

void addRoom(TestScene& test) {
    const Material grey = constantMaterial("/M/Grey", {0.6F, 0.5F, 0.4F});
    test.add("/Floor", quadMesh({-4, -1, 4}, {8, 0, 0}, {0, 0, -8}), grey);
    test.add("/Back", quadMesh({-4, -1, -4}, {8, 0, 0}, {0, 4, 0}), grey);
    test.add("/Ball", sphereMesh(0.8F, 32, false), grey, translation(0, 0, -2));
    test.addSky(Rgb(0.5F, 0.6F, 0.8F));
}

} // namespace

int main(int argc, char** argv) {
    const int samples = argc == 2 ? std::atoi(argv[1]) : 0;
    if (samples <= 0) {
        std::fprintf(stderr, "targetBench SAMPLES\n");
        return 2;
    }
    doctest::Context context; // what the tests' scenes check is checked here too
    context.setAsDefaultForAssertsOutOfTestCases();
    context.setAssertHandler([](const doctest::AssertData& data) {
        if (data.m_failed) {
            std::fprintf(stderr, "%s:%d: %s\n", data.m_file, data.m_line, data.m_expr);
            std::abort();
        }
    });
    TestScene test;
    addRoom(test);
    RenderJob job;
    job.options = exactOptions(samples);
    job.options.kernel = Kernel::kAvx2;
    job.options.threads = 1;
    FilmRequest request;
    request.window.width = request.window.height = kSide;
    request.window.data = {0, 0, kSide, kSide};
    RenderView view;
    view.camera = testCamera({0, 0.5, 3}, 0.7F);
    view.film = std::make_shared<Film>(request);
    job.views.push_back(view);
    Renderer renderer(test.scene);
    renderer.start(std::move(job));
    renderer.wait();
    std::printf("%.17g\n", meanOf(*view.film, "color"));
    return renderer.isConverged() ? 0 : 1;
}
