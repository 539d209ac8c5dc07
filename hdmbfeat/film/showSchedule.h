// When a viewer's buffers are brought up to date while an image is rendered. Showing takes time
// that the render threads want too: for several AOVs of a large image tens of milliseconds.
#pragma once

#include <cstdint>

#include "core/clock.h"
#include "scene/camera.h"

namespace mbfeat {

/// Due whenever another grid of the first pass is whole (film/risingPass.h), and else so often that
/// showing takes a tenth of the time. Until the first grid is whole, or that takes long, the
/// buffers keep the image before.
class ShowSchedule {
public:
    /// A new image begins.
    void start(const PixelRect& data, Clock::time_point now);
    /// Whether to show the image, which has so many samples by now.
    bool isDue(std::uint64_t samples, Clock::time_point now) const;
    /// It was shown, with so many samples, which took from `begin` to `end`.
    void shown(std::uint64_t samples, Clock::time_point begin, Clock::time_point end);

private:
    PixelRect data_;
    int grids_ = 0; ///< whole ones that were shown
    Clock::time_point next_;
};

} // namespace mbfeat
