// The exchange between a host program and the delegates in its process. A host that knows nothing
// of it (usdview, OpenUSD's own usdrecord) gets the defaults; our command uses it for settings of
// the command line, progress, interruption and the finished films. Any member, any thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/diagnostics.h"
#include "film/film.h"
#include "film/product.h"
#include "film/report.h"

namespace mbfeat {

/// What the last completed job left: its films with the products that were made of them.
struct FinishedFrame {
    struct Image {
        std::shared_ptr<const Film> film;
        std::string cameraPath;
        std::vector<ProductSpec> products; ///< empty for the viewport's film
    };
    std::vector<Image> images; ///< first: the viewport's, or the first product's
    RenderReport report;
};

class Host {
public:
    static Host& instance();

    /// Settings of the command line, by name; read by every delegate when it resolves settings.
    void setOverrides(std::vector<std::pair<std::string, std::string>> overrides);
    std::vector<std::pair<std::string, std::string>> overrides() const;

    /// Root layer of the stage being rendered, for headers.
    void setStage(std::string stage);
    std::string stage() const;

    /// Ends all running jobs within a second; they report converged and interrupted.
    void requestStop();
    void clearStop();
    bool stopRequested() const;
    /// Makes SIGINT call requestStop() (a second one ends the process at once). Async-signal-safe
    /// inside. restoreInterruptHandler() puts the previous handler back.
    void installInterruptHandler();
    void restoreInterruptHandler();

    /// Progress of batch jobs on stderr: none, a line now and then (the default, so that a host
    /// that knows nothing of this has it too), or a bar. Interactive jobs show none.
    enum class ProgressStyle : std::uint8_t { kNone, kLines, kBar };
    void setProgressStyle(ProgressStyle style);
    ProgressStyle progressStyle() const;

    /// Takes the delegates' messages from the application's own channel (OpenUSD's diagnostics),
    /// which they go to without a handler. It is called on any thread, one thread at a time, and
    /// must not change the handler.
    void setMessageHandler(std::function<void(const Message&)> handler);
    /// Gives a message to the handler; false when there is none.
    bool deliver(const Message& message) const;

    void publish(std::shared_ptr<const FinishedFrame> frame);
    /// The last published frame, or null.
    std::shared_ptr<const FinishedFrame> lastFrame() const;
    void dropLastFrame();

private:
    Host();
    ~Host();
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace mbfeat
