// Headers of product files. Internal to film/.
#pragma once

#include <optional>
#include <string>

#include <ImfCompression.h>
#include <ImfHeader.h>

#include "film/product.h"

namespace mbfeat {

/// OpenEXR's compression of a name; nothing for an unknown one, or for one that deep files lack.
std::optional<Imf::Compression> exrCompression(const std::string& name, bool deep);
/// The name of a compression, as in ProductSpec.
std::string exrCompressionName(Imf::Compression compression);

/// A header without channels: windows, camera, compression, the report's attributes and the
/// product's.
Imf::Header exrHeader(const ProductSpec& product, const Film& film, const RenderReport& report);

/// Adds a text attribute: the name is cut to what EXR can hold, both are made valid UTF-8.
void addTextAttribute(Imf::Header& header, const std::string& name, const std::string& text);

} // namespace mbfeat
