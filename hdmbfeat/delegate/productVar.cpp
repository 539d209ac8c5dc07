#include "delegate/productVar.h"

#include <cctype>
#include <map>

#include "delegate/products.h"
#include "delegate/tokens.h"
#include "delegate/values.h"
#include "film/aovTable.h"

namespace mbfeat {

namespace {

constexpr const char* kPrimvarPrefix = "primvars:";
constexpr const char* kExrPrefix = "driver:parameters:OpenEXR:";

bool startsWith(const std::string& text, const char* prefix) {
    return text.rfind(prefix, 0) == 0;
}

/// "half", "half3", "color4h" and the like store 16 bits.
bool isHalf(const std::string& format) {
    if (startsWith(format, "half")) {
        return true;
    }
    const std::size_t size = format.size();
    return size >= 2 && format[size - 1] == 'h' &&
           std::isdigit(static_cast<unsigned char>(format[size - 2])) != 0;
}

PixelType pixelType(const HdRenderSettings::RenderProduct::RenderVar& var,
                    const AovDescriptor& aov) {
    if (aov.type == AovType::kInt) {
        return PixelType::kUInt;
    }
    const std::string format =
        asText(findSettingValue(var.namespacedSettings, "driver:parameters:aov:format"))
            .value_or(var.dataType.GetString());
    return isHalf(format) ? PixelType::kHalf : PixelType::kFloat;
}

} // namespace

std::string primvarOfAov(const std::string& aov) {
    return startsWith(aov, kPrimvarPrefix) ? aov.substr(std::string(kPrimvarPrefix).size()) : "";
}

std::string aovOfVar(const HdRenderSettings::RenderProduct::RenderVar& var) {
    const std::string name = var.sourceName.empty() ? var.varPath.GetName() : var.sourceName;
    const bool isPrimvar = var.sourceType == "primvar" && !startsWith(name, kPrimvarPrefix);
    return isPrimvar ? kPrimvarPrefix + name : name;
}

Result<ProductLayer> translateVar(const HdRenderSettings::RenderProduct::RenderVar& var) {
    const std::string name = aovOfVar(var);
    if (var.sourceType == "lpe") {
        return Error{var.varPath.GetString(),
                     "light path expressions are not supported (" + var.sourceName +
                         "); the var is left out. mbfeat:contribution:0 to :5 and "
                         "mbfeat:direct:0 to :5 are raw vars that split the image by bounce."};
    }
    const std::optional<AovDescriptor> aov = findAov(name);
    if (!aov) {
        return Error{var.varPath.GetString(), "there is no AOV " + name +
                                                  "; the var is left out. The nearest name is " +
                                                  nearestAovName(name) + "."};
    }
    ProductLayer layer;
    layer.aov = name;
    layer.layer = asText(findSettingValue(var.namespacedSettings, "driver:parameters:aov:name"))
                      .value_or(var.varPath.GetName());
    layer.pixelType = pixelType(var, *aov);
    return layer;
}

void readProductAttributes(const HdRenderSettings::RenderProduct& product, ProductSpec& spec,
                           Diagnostics& diagnostics) {
    spec.path = product.name.GetString();
    spec.primPath = product.productPath.GetString();
    spec.deep = product.type == tokens().deepRaster;
    spec.compression = spec.deep ? "zips" : "zip";
    for (const auto& [name, value] : flattened(product.namespacedSettings)) {
        const std::string text = describe(value);
        if (name == "mbfeat:exr:compression" || name == std::string(kExrPrefix) + "compression") {
            spec.compression = text;
        } else if (name == "mbfeat:exr:layout") {
            spec.multiPart = text == "multipart";
            if (text != "multipart" && text != "multilayer") {
                diagnostics.warn(spec.primPath,
                                 "mbfeat:exr:layout is \"" + text +
                                     "\"; multilayer is used. multilayer and multipart are valid.");
            }
        } else if (startsWith(name, kExrPrefix)) {
            spec.attributes.emplace_back(name.substr(std::string(kExrPrefix).size()), text);
        } else if (name == "driver:parameters:artist" || name == "driver:parameters:comment" ||
                   name == "driver:parameters:hostname") {
            spec.attributes.emplace_back(name.substr(std::string("driver:parameters:").size()),
                                         text);
        }
    }
}

} // namespace mbfeat
