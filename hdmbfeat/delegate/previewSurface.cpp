// UsdPreviewSurface and its texture, primvar and transform nodes.
#include "delegate/materialNetwork.h"
#include "delegate/values.h"

namespace mbfeat {

namespace {

bool startsWith(const std::string& text, const char* prefix) {
    return text.rfind(prefix, 0) == 0;
}

/// First channel of an output such as "rgb", "r" or "outa".
int channelOf(const std::string& output) {
    if (output.empty()) {
        return 0;
    }
    switch (output.back()) {
    case 'g':
        return 1;
    case 'b':
        return output.size() >= 3 && output[output.size() - 2] == 'g' ? 0 : 2;
    case 'a':
        return output.size() >= 4 && output[output.size() - 2] == 'b' ? 0 : 3;
    default:
        return 0;
    }
}

Wrap wrapOf(const VtValue& value) {
    const std::string name = asText(value).value_or("useMetadata");
    if (name == "repeat" || name == "periodic") {
        return Wrap::kRepeat;
    }
    if (name == "clamp") {
        return Wrap::kClamp;
    }
    if (name == "mirror") {
        return Wrap::kMirror;
    }
    return Wrap::kBlack; // also useMetadata: image files here carry no wrap modes
}

/// The coordinates that reach a texture: a primvar, perhaps through a 2D transform.
void translateCoordinates(const NetworkNode& node, const char* input, TextureNode& texture,
                          MaterialBuilder& builder) {
    const NetworkNode source = node.connected(input);
    if (!source) {
        texture.uvPrimvar.clear();
        texture.stFallback = asFloat2(node.parameter(input)).value_or(Float2(0.0F, 0.0F));
        return;
    }
    if (source.type() == "UsdTransform2d" || source.type() == "ND_UsdTransform2d") {
        texture.stScale = asFloat2(source.parameter("scale")).value_or(Float2(1.0F, 1.0F));
        texture.stRotation = asFloat(source.parameter("rotation"), 0.0F);
        texture.stTranslation =
            asFloat2(source.parameter("translation")).value_or(Float2(0.0F, 0.0F));
        const NetworkNode inner = source.connected("in");
        if (inner && inner.type() != source.type()) {
            translateCoordinates(source, "in", texture, builder);
            return;
        }
        texture.stFallback = asFloat2(source.parameter("in")).value_or(Float2(0.0F, 0.0F));
        if (inner) {
            builder.warn("node " + source.path().GetString() +
                         " transforms texture coordinates a second time; the constant " +
                         "coordinates are used. Combine the two UsdTransform2d nodes.");
        }
        texture.uvPrimvar.clear();
        return;
    }
    if (startsWith(source.type(), "UsdPrimvarReader") ||
        startsWith(source.type(), "ND_UsdPrimvarReader")) {
        texture.uvPrimvar = asText(source.parameter("varname")).value_or("");
        texture.stFallback = asFloat2(source.parameter("fallback")).value_or(Float2(0.0F, 0.0F));
        if (texture.uvPrimvar.empty()) {
            builder.warn("node " + source.path().GetString() +
                         " names no primvar; its fallback coordinates are used. Author varname.");
        }
        return;
    }
    builder.warn("texture coordinates come from the unknown node " + source.type() +
                 "; the primvar st is used. Use a UsdPrimvarReader_float2.");
}

TextureNode translateTexture(const NetworkNode& node, MaterialBuilder& builder) {
    TextureNode texture;
    texture.image.path = asText(node.parameter("file")).value_or("");
    std::string space = asText(node.parameter("sourceColorSpace")).value_or("auto");
    if (space == "auto") {
        space = asText(node.parameter("colorSpace:file")).value_or("auto");
    }
    setColorSpace(texture.image, space);
    texture.wrapS = wrapOf(node.parameter("wrapS"));
    texture.wrapT = wrapOf(node.parameter("wrapT"));
    texture.scale = asFloat4(node.parameter("scale")).value_or(texture.scale);
    texture.bias = asFloat4(node.parameter("bias")).value_or(texture.bias);
    texture.fallback = asFloat4(node.parameter("fallback")).value_or(texture.fallback);
    translateCoordinates(node, "st", texture, builder);
    return texture;
}

/// The constant, texture or primvar that feeds an input.
void translateInput(const NetworkNode& node, const char* name, MaterialInput& input,
                    MaterialBuilder& builder) {
    if (const std::optional<Float3> constant = asFloat3(node.parameter(name))) {
        input.value = *constant;
    }
    std::string output;
    const NetworkNode source = node.connected(name, &output);
    if (!source) {
        return;
    }
    if (source.type() == "UsdUVTexture" || source.type() == "ND_UsdUVTexture") {
        const TextureNode texture = translateTexture(source, builder);
        const int channel = channelOf(output);
        if (texture.image.path.empty()) {
            builder.warn(std::string("the texture of input ") + name + ", " +
                         source.path().GetString() + ", names no file; its fallback is used.");
            const Float4& f = texture.fallback;
            input.value = output.size() > 1
                              ? Float3(f.x, f.y, f.z)
                              : Float3(channel == 3 ? f.w : Float3(f.x, f.y, f.z)[channel]);
            return;
        }
        builder.setTexture(input, texture, channel);
        return;
    }
    if (startsWith(source.type(), "UsdPrimvarReader") ||
        startsWith(source.type(), "ND_UsdPrimvarReader")) {
        input.source = MaterialInput::Source::kPrimvar;
        input.primvar = asText(source.parameter("varname")).value_or("");
        input.value = asFloat3(source.parameter("fallback")).value_or(Float3(0.0F));
        return;
    }
    builder.warn(std::string("input ") + name + " is connected to the unknown node " +
                 source.type() + "; its constant is used. Use a UsdUVTexture or a " +
                 "UsdPrimvarReader.");
}

} // namespace

void translatePreviewSurface(const NetworkNode& surface, MaterialBuilder& builder) {
    Material& m = builder.material();
    for (const auto& [name, input] : inputsOf(m)) {
        translateInput(surface, name, *input, builder);
    }
    m.useSpecularWorkflow = asBool(surface.parameter("useSpecularWorkflow"), false);
    const VtValue mode = surface.parameter("opacityMode");
    // UsdPreviewSurface has a token, the MaterialX node of the same name an integer.
    if (asText(mode).value_or("") == "presence" || asNumber(mode).value_or(0.0) == 1.0) {
        m.opacityMode = OpacityMode::kPresence;
    }
}

} // namespace mbfeat
