#include "film/progress.h"

#include <cstdio>
#include <memory>

#include <doctest/doctest.h>

using namespace mbfeat;

namespace {

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

class ScratchFile {
public:
    std::FILE* get() const { return file_.get(); }
    std::string text() const {
        std::string result;
        std::rewind(file_.get());
        for (int c = std::fgetc(file_.get()); c != EOF; c = std::fgetc(file_.get())) {
            result += static_cast<char>(c);
        }
        return result;
    }

private:
    std::unique_ptr<std::FILE, CloseFile> file_{std::tmpfile()};
};

RenderProgress at(double fraction, double seconds) {
    RenderProgress progress;
    progress.fraction = fraction;
    progress.seconds = seconds;
    progress.samplesPerSecond = 1.5e6;
    progress.secondsLeft = fraction > 0.0 ? seconds * (1.0 - fraction) / fraction : 0.0;
    return progress;
}

} // namespace

TEST_CASE("progress says percentage, speed and time left") {
    CHECK(progressText(at(0.5, 30.0)) == " 50.0 %  1.50 M samples/s  0:30 left");
    CHECK(progressText(at(0.999, 0.0)) == " 99.9 %  1.50 M samples/s");
    CHECK(progressText(at(1.0, 3725.0)) == "100.0 %  1.50 M samples/s  in 1:02:05");
    RenderProgress slow;
    slow.samplesPerSecond = 812.0;
    CHECK(progressText(slow) == "  0.0 %  812 samples/s");
    slow.samplesPerSecond = 0.0;
    CHECK(progressText(slow) == "  0.0 %");
}

TEST_CASE("lines come every few seconds, and last what the render ended with") {
    const ScratchFile file;
    ProgressReporter reporter(Host::ProgressStyle::kBar, "frame 3", file.get());
    for (int tick = 0; tick <= 120; ++tick) {
        reporter.update(at(tick / 120.0, tick * 0.1));
    }
    reporter.finish();
    CHECK(file.text() == "MBFeat: frame 3:  41.6 %  1.50 M samples/s  0:07 left\n"
                         "MBFeat: frame 3:  83.3 %  1.50 M samples/s  0:02 left\n"
                         "MBFeat: frame 3: 100.0 %  1.50 M samples/s  in 0:12\n");
}

TEST_CASE("short renders and silent ones say nothing") {
    const ScratchFile file;
    ProgressReporter brief(Host::ProgressStyle::kLines, "", file.get());
    brief.update(at(1.0, 1.0));
    brief.finish();
    ProgressReporter silent(Host::ProgressStyle::kNone, "", file.get());
    silent.update(at(0.5, 100.0));
    silent.finish();
    CHECK(file.text().empty());
}
