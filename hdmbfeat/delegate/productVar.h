// Render vars and product attributes as layers and file options.
#pragma once

#include "pxr/pxr.h"

#include <string>

#include "core/diagnostics.h"
#include "film/product.h"
#include "pxr/imaging/hd/renderSettings.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

/// The layer of a var: its AOV, the layer's name (driver:parameters:aov:name, else the var prim's
/// name) and the stored type (driver:parameters:aov:format, else dataType). Error: no such AOV.
Result<ProductLayer> translateVar(const HdRenderSettings::RenderProduct::RenderVar& var);

/// Path, type, compression, layout and header attributes of a product.
void readProductAttributes(const HdRenderSettings::RenderProduct& product, ProductSpec& spec,
                           Diagnostics& diagnostics);

/// "st" for "primvars:st", empty for other AOVs.
std::string primvarOfAov(const std::string& aov);

} // namespace mbfeat
