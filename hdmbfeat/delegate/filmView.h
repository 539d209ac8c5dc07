// Films shown in AOV buffers.
#pragma once

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
void showFilm(const Film& film, int aovIndex, const FilmPlacement& placement, bool asColor,
              RenderBuffer& buffer);

} // namespace mbfeat
