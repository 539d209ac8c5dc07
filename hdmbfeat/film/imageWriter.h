// Images for people to look at: display-referred values into PNG, JPEG and the like.
//
// EXR files are products (film/product.h); these formats carry neither AOVs nor headers.
#pragma once

#include <string>

#include "core/diagnostics.h"

namespace mbfeat {

/// Writes interleaved values of 1..4 channels, row 0 at the top, in the format that the path's
/// extension names: .png, .jpg, .jpeg, .bmp and .tga hold eight bits, for which values are clamped
/// to 0..1 and rounded (NaN: 0); .hdr holds floats as they are. JPEG, BMP and HDR drop alpha.
///
/// The file is written beside its target and renamed. Errors name the file: a format that is not
/// known, a folder that cannot be written, a full disk.
Status writeImageFile(const std::string& path, int width, int height, int channels,
                      const float* values);

/// The extensions of writeImageFile(), for messages: ".png, .jpg, ...".
std::string imageFileExtensions();

} // namespace mbfeat
