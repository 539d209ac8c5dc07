// Runs the catalogue of hard cases and prints what each found, a JSON object a line.
//
//   mbfeat_stability [--filter GLOB] [--pictures DIR] [--traps] [--list]
//
// Exit code: 0 when all passed, 1 when a case failed, 2 for wrong arguments.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <string>

#include <fnmatch.h>

#include "families.h"
#include "film/imageWriter.h"
#include "film/json.h"
#include "trapHandler.h"

namespace {

using namespace mbfeat::stability;

constexpr double kBeyondMeasure = 1e300;

struct Arguments {
    std::string filter = "*";
    std::string pictures; ///< folder; empty: none are written
    bool traps = false, list = false, good = true;
};

Arguments parse(int count, char** values) {
    Arguments arguments;
    for (int i = 1; i < count; ++i) {
        const std::string name = values[i];
        const bool hasValue = i + 1 < count;
        if (name == "--filter" && hasValue) {
            arguments.filter = values[++i];
        } else if (name == "--pictures" && hasValue) {
            arguments.pictures = values[++i];
        } else if (name == "--traps") {
            arguments.traps = true;
        } else if (name == "--list") {
            arguments.list = true;
        } else {
            std::cerr << "mbfeat_stability: " << name << ": unknown, or without a value\n";
            arguments.good = false;
        }
    }
    return arguments;
}

/// The pictures of a case as PNG files, sRGB-encoded. Returns their names.
std::vector<std::string> writePictures(const Case& hard, const Report& report,
                                       const std::string& folder) {
    std::vector<std::string> names;
    for (const Picture& picture : report.pictures()) {
        std::string name = hard.name + "-" + picture.name + ".png";
        for (char& c : name) {
            c = c == '/' ? '-' : c;
        }
        std::vector<float> display = picture.rgb;
        for (float& v : display) {
            v = v <= 0.0031308F ? 12.92F * v : 1.055F * std::pow(v, 1.0F / 2.4F) - 0.055F;
        }
        const mbfeat::Status written = mbfeat::writeImageFile(folder + "/" + name, picture.width,
                                                              picture.height, 3, display.data());
        if (written) {
            std::cerr << "mbfeat_stability: " << written->subject << ": " << written->text << "\n";
        } else {
            names.push_back(name);
        }
    }
    return names;
}

bool runCase(const Case& hard, const Arguments& arguments) {
    Report report;
    std::string failure;
    const auto started = std::chrono::steady_clock::now();
    switchTraps(arguments.traps);
    try {
        hard.run(report);
    } catch (const std::exception& error) {
        failure = std::string("threw: ") + error.what();
    }
    switchTraps(false);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - started;
    const std::vector<std::string> traps = takeTraps();
    if (failure.empty() && report.count() == 0) {
        failure = "measured nothing";
    }
    const bool passed = failure.empty() && report.worst() <= hard.budget && traps.empty();
    std::vector<std::string> pictures;
    if (!passed && !arguments.pictures.empty()) {
        pictures = writePictures(hard, report, arguments.pictures);
    }
    mbfeat::JsonWriter json;
    json.beginObject();
    json.key("case").value(hard.name).key("check").value(hard.check);
    // JSON has no infinity; what is no number at all is as bad.
    const double worst = std::isfinite(report.worst()) ? report.worst() : kBeyondMeasure;
    json.key("worst").value(worst).key("budget").value(hard.budget);
    json.key("verdict").value(passed ? "pass" : "fail").key("reason").value(hard.reason);
    json.key("where").value(failure.empty() ? report.where() : failure);
    json.key("measured").value(static_cast<std::int64_t>(report.count()));
    json.key("traps").value(traps).key("pictures").value(pictures);
    json.key("seconds").value(seconds.count());
    json.endObject();
    std::cout << json.text() << std::endl; // flushed: somebody shows the progress
    return passed;
}

} // namespace

int main(int count, char** values) {
    const Arguments arguments = parse(count, values);
    if (!arguments.good) {
        return 2;
    }
    if (arguments.traps && !trapsAreSupported()) {
        std::cerr << "mbfeat_stability: --traps needs a debug build (cmake --preset debug)\n";
        return 2;
    }
    installTrapHandler();
    bool allPassed = true;
    int selected = 0;
    for (const Case& hard : allCases()) {
        if (fnmatch(arguments.filter.c_str(), hard.name.c_str(), 0) != 0) {
            continue;
        }
        ++selected;
        if (arguments.list) {
            std::cout << hard.name << "\n";
        } else {
            allPassed = runCase(hard, arguments) && allPassed;
        }
    }
    if (selected == 0) {
        std::cerr << "mbfeat_stability: no case is named " << arguments.filter << "\n";
        return 2;
    }
    return allPassed ? 0 : 1;
}
