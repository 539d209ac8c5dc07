#include "film/progress.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <sys/ioctl.h>
#include <unistd.h>

namespace mbfeat {

namespace {

constexpr double kLineInterval = 5.0; // seconds
constexpr double kBarInterval = 0.1;
constexpr int kLongestBar = 40; // characters

template <class... Values>
std::string formatted(const char* format, Values... values) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), format, values...);
    return text.data();
}

std::string rateText(double rate) {
    constexpr std::array<std::pair<double, const char*>, 3> kUnits = {
        {{1e9, "G "}, {1e6, "M "}, {1e3, "k "}}};
    for (const auto& [factor, unit] : kUnits) {
        if (rate >= factor) {
            return formatted("%.2f %s", rate / factor, unit);
        }
    }
    return formatted("%.0f ", rate);
}

std::string durationText(double seconds) {
    const auto total = static_cast<long>(std::lround(std::min(seconds, 1e9)));
    const long hours = total / 3600;
    const long minutes = total / 60 % 60;
    return hours > 0 ? formatted("%ld:%02ld:%02ld", hours, minutes, total % 60)
                     : formatted("%ld:%02ld", minutes, total % 60);
}

int terminalWidth(std::FILE* out) {
    winsize size = {};
    const bool known = ioctl(fileno(out), TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    return known ? size.ws_col : 80;
}

} // namespace

std::string progressText(const RenderProgress& progress) {
    const double percent = std::clamp(progress.fraction, 0.0, 1.0) * 100.0;
    // Rounded down: 100 % is said of a complete render only.
    std::string text = formatted("%5.1f %%", std::floor(percent * 10.0) / 10.0);
    if (progress.samplesPerSecond > 0.0) {
        text += "  " + rateText(progress.samplesPerSecond) + "samples/s";
    }
    if (progress.fraction >= 1.0) {
        text += "  in " + durationText(progress.seconds);
    } else if (progress.secondsLeft > 0.0) {
        text += "  " + durationText(progress.secondsLeft) + " left";
    }
    return text;
}

ProgressReporter::ProgressReporter(Host::ProgressStyle style, std::string label, std::FILE* out)
    : style_(style),
      label_(std::move(label)),
      out_(out) {
    if (style_ == Host::ProgressStyle::kBar && isatty(fileno(out_)) == 0) {
        style_ = Host::ProgressStyle::kLines;
    }
}

void ProgressReporter::update(const RenderProgress& progress) {
    last_ = progress;
    const bool bar = style_ == Host::ProgressStyle::kBar;
    const double interval = bar ? kBarInterval : kLineInterval;
    if (style_ != Host::ProgressStyle::kNone && progress.seconds - shownAt_ >= interval) {
        show(progress);
    }
}

void ProgressReporter::finish() {
    if (shown_) {
        show(last_);
        if (style_ == Host::ProgressStyle::kBar) {
            std::fputc('\n', out_);
            std::fflush(out_);
        }
    }
    shown_ = false;
    shownAt_ = 0.0;
}

void ProgressReporter::show(const RenderProgress& progress) {
    const std::string head = "MBFeat: " + (label_.empty() ? "" : label_ + ": ");
    const std::string text = progressText(progress);
    if (style_ == Host::ProgressStyle::kLines) {
        std::fprintf(out_, "%s%s\n", head.c_str(), text.c_str());
    } else {
        const int room = terminalWidth(out_) - static_cast<int>(head.size() + text.size()) - 4;
        const int length = std::clamp(room, 0, kLongestBar);
        const double fraction = std::clamp(progress.fraction, 0.0, 1.0);
        const auto full = static_cast<std::size_t>(fraction * length);
        std::string bar(full, '#');
        bar.resize(static_cast<std::size_t>(length), '-');
        // Carriage return first and erase to the end of the line last: other messages that come
        // between start on the bar's line and stay readable.
        std::fprintf(out_, "\r%s[%s] %s\x1b[K", head.c_str(), bar.c_str(), text.c_str());
    }
    std::fflush(out_);
    shown_ = true;
    shownAt_ = progress.seconds;
}

} // namespace mbfeat
