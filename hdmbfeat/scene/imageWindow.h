// Which pixels an image consists of.
#pragma once

#include <optional>

#include "core/vec.h"
#include "scene/camera.h"

namespace mbfeat {

/// The pixels of a width x height image whose centres lie in the window [min, max) given in
/// normalised device coordinates: (0, 0) is the image's bottom left, (1, 1) its top right, values
/// outside are overscan (UsdRenderSettingsBase, dataWindowNDC). Rows count downwards from the top.
/// Nothing when the window is empty, inverted or not finite, or has more than 2^28 pixels.
std::optional<PixelRect> dataWindowPixels(int width, int height, Float2 min, Float2 max);

} // namespace mbfeat
