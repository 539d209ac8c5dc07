// Films shown in AOV buffers.
#pragma once

#include <cstdint>
#include <vector>

#include "delegate/renderBuffer.h"
#include "film/film.h"

namespace mbfeat {

/// Where a film lands in the buffers: pixel for pixel at an offset, or fitted into them.
struct FilmPlacement {
    int bufferX = 0, bufferY = 0; ///< buffer position of display pixel (0, 0)
    bool fit = false; ///< the display window is scaled to fit the buffer, its shape kept
};

/// Copies an AOV's current values into a buffer. `asColor` spreads AOVs of one or two channels
/// over red, green and blue with alpha 1, for AOVs that are looked at in place of `color`.
/// `sampled` (film/risingPass.h) says which pixels have samples, so that others stand for those
/// that have none; empty: all have.
void showFilm(const Film& film, int aovIndex, const FilmPlacement& placement,
              const std::vector<std::uint8_t>& sampled, bool asColor, RenderBuffer& buffer);

} // namespace mbfeat
