// MaterialX surfaces by their nearest UsdPreviewSurface inputs.
//
// What the three surface models share with UsdPreviewSurface is taken over: base colour, metalness,
// roughness, index of refraction, coat, transmission, emission, opacity and normal, as constants or
// directly connected images. Node graphs are looked through for the nearest image or constant. One
// message a material says what was not followed.
#include <algorithm>
#include <cmath>

#include "delegate/materialNetwork.h"
#include "delegate/values.h"

namespace mbfeat {

namespace {

constexpr int kDeepestSearch = 16;

bool startsWith(const std::string& text, const char* prefix) {
    return text.rfind(prefix, 0) == 0;
}

bool contains(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
}

bool isImage(const NetworkNode& node) {
    return node.type() == "ND_UsdUVTexture" || startsWith(node.type(), "ND_image_") ||
           startsWith(node.type(), "ND_tiledimage_") || startsWith(node.type(), "ND_gltf_image") ||
           startsWith(node.type(), "ND_gltf_colorimage");
}

Wrap wrapOf(const VtValue& value) {
    const std::string mode = asText(value).value_or("periodic");
    return mode == "clamp"      ? Wrap::kClamp
           : mode == "mirror"   ? Wrap::kMirror
           : mode == "constant" ? Wrap::kBlack
                                : Wrap::kRepeat;
}

/// Inputs of one surface shader, with what had to be simplified on the way.
class SurfaceReader {
public:
    SurfaceReader(const NetworkNode& surface, MaterialBuilder& builder)
        : surface_(surface),
          builder_(builder) {}

    /// The input as a constant, texture or primvar; its default where nothing is authored.
    MaterialInput read(const char* name, const Float3& defaultValue) {
        MaterialInput input(defaultValue);
        if (const std::optional<Float3> constant = asFloat3(surface_.parameter(name))) {
            input.value = *constant;
        }
        if (const NetworkNode node = surface_.connected(name, &output_)) {
            follow(node, name, input, 0);
        }
        return input;
    }
    /// The input's constant, for models whose combination with others has to be one.
    float number(const char* name, float defaultValue) {
        return read(name, Float3(defaultValue)).value.x;
    }
    bool isTextured(const MaterialInput& input) const {
        return input.source != MaterialInput::Source::kConstant;
    }

    void report(const std::string& model) {
        std::string text =
            "the MaterialX surface " + model + " is shown by its nearest UsdPreviewSurface inputs";
        if (!simplified_.empty()) {
            text += "; simplified:";
            for (const std::string& name : simplified_) {
                text += " " + name;
            }
        }
        builder_.inform(text + ".");
    }
    void simplify(const std::string& what) {
        if (std::find(simplified_.begin(), simplified_.end(), what) == simplified_.end()) {
            simplified_.push_back(what);
        }
    }

private:
    void follow(const NetworkNode& node, const char* name, MaterialInput& input, int depth) {
        if (isImage(node)) {
            readImage(node, input);
        } else if (startsWith(node.type(), "ND_constant_")) {
            input.value = asFloat3(node.parameter("value")).value_or(input.value);
        } else if (startsWith(node.type(), "ND_geompropvalue_")) {
            input.source = MaterialInput::Source::kPrimvar;
            input.primvar = asText(node.parameter("geomprop")).value_or("");
            input.value = asFloat3(node.parameter("default")).value_or(input.value);
        } else if (startsWith(node.type(), "ND_normalmap")) {
            readNormalMap(node, input);
        } else {
            simplify(std::string(name) + " (" + node.type() + ")");
            search(node, name, input, depth);
        }
    }

    /// The first image upstream, in the order of input names; else the node's own constant.
    void search(const NetworkNode& node, const char* name, MaterialInput& input, int depth) {
        if (depth >= kDeepestSearch) {
            return;
        }
        for (const char* const constant : {"in", "in1", "fg", "base", "value"}) {
            if (const std::optional<Float3> value = asFloat3(node.parameter(constant))) {
                input.value = *value;
                break;
            }
        }
        for (const std::string& connection : node.connectedInputs()) {
            if (isTextured(input)) {
                return;
            }
            if (connection == "texcoord" || connection == "mask") {
                continue;
            }
            if (const NetworkNode upstream = node.connected(connection.c_str(), &output_)) {
                follow(upstream, name, input, depth + 1);
            }
        }
    }

    void readImage(const NetworkNode& node, MaterialInput& input) {
        const Float3 fallback = asFloat3(node.parameter("default")).value_or(Float3(0.0F));
        TextureNode texture;
        texture.image.path = asText(node.parameter("file")).value_or("");
        if (texture.image.path.empty()) { // MaterialX: an image without a file is its default
            input.value = fallback;
            return;
        }
        // Values are raw unless a colour space is authored (MaterialX 1.38, "Color Spaces").
        setColorSpace(texture.image, asText(node.parameter("colorSpace:file")).value_or("raw"));
        texture.wrapS = wrapOf(node.parameter("uaddressmode"));
        texture.wrapT = wrapOf(node.parameter("vaddressmode"));
        texture.fallback = {fallback.x, fallback.y, fallback.z, 1.0F};
        texture.stScale = asFloat2(node.parameter("uvtiling")).value_or(texture.stScale);
        const NetworkNode coordinates = node.connected("texcoord");
        if (coordinates && startsWith(coordinates.type(), "ND_geompropvalue_")) {
            texture.uvPrimvar = asText(coordinates.parameter("geomprop")).value_or("st");
        } else if (coordinates && contains(coordinates.type(), "UsdPrimvarReader")) {
            texture.uvPrimvar = asText(coordinates.parameter("varname")).value_or("st");
        } else if (coordinates && !startsWith(coordinates.type(), "ND_texcoord")) {
            simplify("texture coordinates (" + coordinates.type() + ")");
        }
        builder_.setTexture(input, texture, output_ == "outa" ? 3 : 0);
    }

    void readNormalMap(const NetworkNode& node, MaterialInput& input) {
        const NetworkNode image = node.connected("in");
        if (!image || !isImage(image)) {
            simplify("normal");
            return;
        }
        readImage(image, input);
        if (!isTextured(input)) {
            input.value = Float3(0.0F, 0.0F, 1.0F);
            return;
        }
        TextureNode texture = builder_.material().textures[static_cast<std::size_t>(input.texture)];
        texture.scale = {2.0F, 2.0F, 2.0F, 1.0F};
        texture.bias = {-1.0F, -1.0F, -1.0F, 0.0F};
        builder_.setTexture(input, texture, 0);
    }

    const NetworkNode& surface_;
    MaterialBuilder& builder_;
    std::string output_;
    std::vector<std::string> simplified_;
};

/// A weight in front of a colour goes into the constant or into the texture's scale.
void scaleBy(MaterialInput& input, float weight, MaterialBuilder& builder) {
    if (weight == 1.0F) {
        return;
    }
    if (input.source != MaterialInput::Source::kTexture) {
        input.value = input.value * weight;
        return;
    }
    TextureNode texture = builder.material().textures[static_cast<std::size_t>(input.texture)];
    texture.scale = {texture.scale.x * weight, texture.scale.y * weight, texture.scale.z * weight,
                     texture.scale.w};
    texture.bias = {texture.bias.x * weight, texture.bias.y * weight, texture.bias.z * weight,
                    texture.bias.w};
    builder.setTexture(input, texture, input.channel);
}

/// Index of refraction whose reflectance at normal incidence is `weight` times that of `ior`.
float weakenedIor(float ior, float weight) {
    const float root = (ior - 1.0F) / (ior + 1.0F);
    const float amplitude = std::sqrt(std::clamp(root * root * weight, 0.0F, 0.98F));
    return (1.0F + amplitude) / (1.0F - amplitude);
}

/// Names of the inputs that standard_surface and open_pbr_surface have under different ones.
struct InputNames {
    const char *base, *baseColor, *metalness, *specular, *roughness, *ior, *transmission,
        *transmissionColor, *subsurface, *subsurfaceColor, *coat, *coatRoughness, *emission,
        *emissionColor, *opacity, *normal;
};

constexpr InputNames kStandardSurface = {
    "base",         "base_color",     "metalness",          "specular",       "specular_roughness",
    "specular_IOR", "transmission",   "transmission_color", "subsurface",     "subsurface_color",
    "coat",         "coat_roughness", "emission",           "emission_color", "opacity",
    "normal"};

constexpr InputNames kOpenPbr = {
    "base_weight",        "base_color",       "base_metalness",      "specular_weight",
    "specular_roughness", "specular_ior",     "transmission_weight", "transmission_color",
    "subsurface_weight",  "subsurface_color", "coat_weight",         "coat_roughness",
    "emission_luminance", "emission_color",   "geometry_opacity",    "geometry_normal"};

/// Defaults that differ between the two models.
struct ModelDefaults {
    float specularRoughness, coatRoughness, subsurfaceColor;
};

void setOpacity(const MaterialInput& opacity, Material& m) {
    m.opacity = opacity;
    m.opacityMode = OpacityMode::kPresence;
}

void setTransmission(SurfaceReader& reader, float transmission, const MaterialInput& color,
                     Material& m) {
    if (transmission <= 0.0F) {
        return;
    }
    m.opacity = MaterialInput(1.0F - std::min(transmission, 1.0F));
    m.opacityMode = OpacityMode::kTransparent;
    if (reader.isTextured(color) || reader.isTextured(m.diffuseColor)) {
        m.diffuseColor = color;
    } else {
        m.diffuseColor.value =
            m.diffuseColor.value * (1.0F - transmission) + color.value * transmission;
    }
}

void translateUber(SurfaceReader& reader, const InputNames& names, const ModelDefaults& defaults,
                   MaterialBuilder& builder) {
    Material& m = builder.material();
    m.diffuseColor = reader.read(names.baseColor, Float3(0.8F));
    scaleBy(m.diffuseColor, reader.number(names.base, 1.0F), builder);
    m.metallic = reader.read(names.metalness, Float3(0.0F));
    m.roughness = reader.read(names.roughness, Float3(defaults.specularRoughness));
    const float transmission = reader.number(names.transmission, 0.0F);
    const float ior = reader.number(names.ior, 1.5F);
    const float specular = reader.number(names.specular, 1.0F);
    m.ior = MaterialInput(transmission > 0.0F ? ior : weakenedIor(ior, specular));

    const float subsurface = reader.number(names.subsurface, 0.0F);
    if (subsurface > 0.0F) {
        reader.simplify("subsurface");
        const MaterialInput color =
            reader.read(names.subsurfaceColor, Float3(defaults.subsurfaceColor));
        if (!reader.isTextured(color) && !reader.isTextured(m.diffuseColor)) {
            m.diffuseColor.value =
                m.diffuseColor.value * (1.0F - subsurface) + color.value * subsurface;
        } else if (subsurface >= 0.5F) {
            m.diffuseColor = color;
        }
    }
    m.clearcoat = reader.read(names.coat, Float3(0.0F));
    m.clearcoatRoughness = reader.read(names.coatRoughness, Float3(defaults.coatRoughness));
    m.emissiveColor = reader.read(names.emissionColor, Float3(1.0F));
    const MaterialInput emission = reader.read(names.emission, Float3(0.0F));
    const bool followsColor = reader.isTextured(emission) && reader.isTextured(m.emissiveColor);
    if (followsColor) {
        reader.simplify(names.emission); // one image for both: the weight is taken as 1
    } else {
        scaleBy(m.emissiveColor, emission.value.x, builder);
    }
    const MaterialInput opacity = reader.read(names.opacity, Float3(1.0F));
    if (reader.isTextured(opacity) || opacity.value.x < 1.0F) {
        setOpacity(opacity, m);
    }
    setTransmission(reader, transmission, reader.read(names.transmissionColor, Float3(1.0F)), m);
    m.normal = reader.read(names.normal, m.normal.value);
}

void translateGltf(SurfaceReader& reader, MaterialBuilder& builder) {
    Material& m = builder.material();
    m.diffuseColor = reader.read("base_color", Float3(1.0F));
    m.metallic = reader.read("metallic", Float3(1.0F));
    m.roughness = reader.read("roughness", Float3(1.0F));
    m.ior = reader.read("ior", Float3(1.5F));
    m.clearcoat = reader.read("clearcoat", Float3(0.0F));
    m.clearcoatRoughness = reader.read("clearcoat_roughness", Float3(0.0F));
    m.emissiveColor = reader.read("emissive", Float3(0.0F));
    scaleBy(m.emissiveColor, reader.number("emissive_strength", 1.0F), builder);
    m.normal = reader.read("normal", m.normal.value);
    const float mode = reader.number("alpha_mode", 0.0F); // opaque, mask, blend
    if (mode > 0.0F) {
        setOpacity(reader.read("alpha", Float3(1.0F)), m);
        if (mode < 1.5F) {
            m.opacityThreshold = reader.read("alpha_cutoff", Float3(0.5F));
        }
    }
    setTransmission(reader, reader.number("transmission", 0.0F), m.diffuseColor, m);
}

} // namespace

bool translateMaterialX(const NetworkNode& surface, MaterialBuilder& builder) {
    SurfaceReader reader(surface, builder);
    std::string model;
    if (startsWith(surface.type(), "ND_standard_surface_surfaceshader")) {
        model = "standard_surface";
        translateUber(reader, kStandardSurface, {0.2F, 0.1F, 1.0F}, builder);
    } else if (startsWith(surface.type(), "ND_open_pbr_surface_surfaceshader")) {
        model = "open_pbr_surface";
        translateUber(reader, kOpenPbr, {0.3F, 0.0F, 0.8F}, builder);
    } else if (startsWith(surface.type(), "ND_gltf_pbr_surfaceshader")) {
        model = "gltf_pbr";
        translateGltf(reader, builder);
    } else {
        return false;
    }
    reader.report(model);
    builder.removeUnusedTextures();
    return true;
}

} // namespace mbfeat
