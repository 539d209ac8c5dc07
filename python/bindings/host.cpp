// The host exchange: settings of the command line, interruption, progress, finished frames.
#include "film/host.h"

#include <cstdio>

#include <unistd.h>

#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings.h"

namespace mbfeat {

namespace nb = nanobind;
using namespace nb::literals;

namespace {

/// A finished frame as Python holds it.
struct FrameHandle {
    std::shared_ptr<const FinishedFrame> frame;
};

/// A message on stderr, on a line of its own even where a progress bar stands.
void printMessage(const std::string& program, const Message& message) {
    const bool overBar =
        Host::instance().progressStyle() == Host::ProgressStyle::kBar && isatty(STDERR_FILENO) != 0;
    const char* const kind = message.severity == Severity::kInfo      ? ""
                             : message.severity == Severity::kWarning ? "warning: "
                                                                      : "error: ";
    std::fprintf(stderr, "%s%s: %s%s%s%s\n", overBar ? "\r\x1b[K" : "", program.c_str(), kind,
                 message.subject.c_str(), message.subject.empty() ? "" : ": ",
                 message.text.c_str());
    std::fflush(stderr);
}

/// The one Host as a class of static functions.
struct HostFace {};

nb::list images(const FrameHandle& handle) {
    nb::list result;
    for (const FinishedFrame::Image& image : handle.frame->images) {
        nb::list products;
        for (const ProductSpec& product : image.products) {
            products.append(product);
        }
        result.append(nb::make_tuple(FilmHandle{image.film}, image.cameraPath, products));
    }
    return result;
}

nb::object lastFrame() {
    std::shared_ptr<const FinishedFrame> frame = Host::instance().lastFrame();
    return frame ? nb::cast(FrameHandle{std::move(frame)}) : nb::none();
}

} // namespace

void bindHost(nb::module_& module) {
    nb::enum_<Host::ProgressStyle>(module, "ProgressStyle")
        .value("NONE", Host::ProgressStyle::kNone)
        .value("LINES", Host::ProgressStyle::kLines)
        .value("BAR", Host::ProgressStyle::kBar);

    nb::class_<FrameHandle>(module, "FinishedFrame",
                            "What the last completed render left in memory.")
        .def_prop_ro("images", &images,
                     nb::sig("def images(self) -> list[tuple[Film, str, list[ProductSpec]]]"),
                     "Films with their camera's path and the products made of them; first is the "
                     "viewport's, or the first product's.")
        .def_prop_ro("report", [](const FrameHandle& handle) { return handle.frame->report; });

    nb::class_<HostFace> host(module, "Host",
                              "The exchange between this process and the delegates in it.");
    host.def_static(
        "set_overrides",
        [](std::vector<std::pair<std::string, std::string>> overrides) {
            Host::instance().setOverrides(std::move(overrides));
        },
        "overrides"_a, "Settings of the command line, as (name, text).");
    host.def_static("overrides", [] { return Host::instance().overrides(); });
    host.def_static(
        "set_stage", [](const std::string& stage) { Host::instance().setStage(stage); }, "stage"_a,
        "Root layer of the stage that is rendered, for file headers.");
    host.def_static("stage", [] { return Host::instance().stage(); });
    host.def_static("request_stop", [] { Host::instance().requestStop(); });
    host.def_static("clear_stop", [] { Host::instance().clearStop(); });
    host.def_static("stop_requested", [] { return Host::instance().stopRequested(); });
    host.def_static(
        "install_interrupt_handler", [] { Host::instance().installInterruptHandler(); },
        "Makes SIGINT stop all renders of the process; a second one ends the process.");
    host.def_static("restore_interrupt_handler",
                    [] { Host::instance().restoreInterruptHandler(); });
    host.def_static(
        "set_progress_style",
        [](Host::ProgressStyle style) { Host::instance().setProgressStyle(style); }, "style"_a);
    host.def_static("progress_style", [] { return Host::instance().progressStyle(); });
    host.def_static(
        "print_messages",
        [](const std::string& program) {
            Host::instance().setMessageHandler(
                [program](const Message& message) { printMessage(program, message); });
        },
        "program"_a,
        "Prints the delegates' messages on stderr as they come, instead of through OpenUSD.");
    host.def_static("last_frame", &lastFrame, nb::sig("def last_frame() -> FinishedFrame | None"));
    host.def_static("drop_last_frame", [] { Host::instance().dropLastFrame(); });
}

} // namespace mbfeat
