#include "scene/dump.h"

#include <charconv>
#include <cstring>

namespace mbfeat {

namespace {

template <class Number>
std::string text(Number value) {
    char buffer[40];
    const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value);
    return {buffer, end.ptr};
}
std::string text(bool value) {
    return value ? "true" : "false";
}
std::string text(const Float2& v) {
    return text(v.x) + " " + text(v.y);
}
template <class T>
std::string text(const Vec3<T>& v) {
    return text(v.x) + " " + text(v.y) + " " + text(v.z);
}
std::string text(const Float4& v) {
    return text(v.x) + " " + text(v.y) + " " + text(v.z) + " " + text(v.w);
}
std::string text(const AffineD& m) {
    return text(m.x) + ", " + text(m.y) + ", " + text(m.z) + ", " + text(m.t);
}
std::string text(const std::string& name) {
    return "'" + name + "'";
}

template <class T>
std::string checksum(const std::vector<T>& values) {
    std::uint64_t hash = 14695981039346656037ULL;
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    for (std::size_t i = 0; i < values.size() * sizeof(T); ++i) {
        hash = (hash ^ bytes[i]) * 1099511628211ULL;
    }
    char buffer[17];
    static constexpr char kDigits[] = "0123456789abcdef";
    for (int i = 15; i >= 0; --i, hash >>= 4) {
        buffer[i] = kDigits[hash & 15];
    }
    buffer[16] = 0;
    return buffer;
}

/// Collects indented lines.
class Writer {
public:
    template <class... Parts>
    void line(int depth, const Parts&... parts) {
        out_.append(2 * static_cast<std::size_t>(depth), ' ');
        ((out_ += parts), ...);
        out_ += '\n';
    }
    std::string take() { return std::move(out_); }

private:
    std::string out_;
};

const char* name(Interpolation interpolation) {
    constexpr const char* kNames[] = {"constant", "uniform", "vertex", "faceVarying"};
    return kNames[static_cast<int>(interpolation)];
}

const char* name(Wrap wrap) {
    constexpr const char* kNames[] = {"black", "clamp", "repeat", "mirror"};
    return kNames[static_cast<int>(wrap)];
}

const char* name(LightType type) {
    constexpr const char* kNames[] = {"rect", "disk", "sphere", "cylinder", "distant", "dome"};
    return kNames[static_cast<int>(type)];
}

std::string describe(const ImageKey& key) {
    constexpr const char* kNames[] = {"auto", "raw", "sRGB", "named"};
    std::string space = kNames[static_cast<int>(key.colorSpace)];
    if (key.colorSpace == SourceColorSpace::kNamed) {
        space += " " + text(key.colorSpaceName);
    }
    return text(key.path) + " " + space;
}

std::string describe(const std::shared_ptr<const Image>& image) {
    constexpr const char* kNames[] = {"unorm8", "srgb8", "unorm16", "srgb16", "half", "float"};
    if (!image) {
        return "none";
    }
    return text(image->width()) + " x " + text(image->height()) + " x " + text(image->channels()) +
           " " + kNames[static_cast<int>(image->storage())];
}

std::string describe(const Attribute& attribute) {
    return std::string(name(attribute.interpolation)) + " width " + text(attribute.width) +
           " values " + text(attribute.values.size()) + " checksum " + checksum(attribute.values);
}

void writeMesh(Writer& out, const Mesh& mesh) {
    Float3 lower = mesh.points.empty() ? Float3(0.0F) : mesh.points.front();
    Float3 upper = lower;
    for (const Float3& p : mesh.points) {
        lower = {min(lower.x, p.x), min(lower.y, p.y), min(lower.z, p.z)};
        upper = {max(upper.x, p.x), max(upper.y, p.y), max(upper.z, p.z)};
    }
    out.line(1, "points ", text(mesh.points.size()), " checksum ", checksum(mesh.points));
    out.line(1, "bounds ", text(lower), ", ", text(upper));
    out.line(1, "triangles ", text(mesh.triangles.size()), " checksum ", checksum(mesh.triangles));
    if (!mesh.triangleFaces.empty()) {
        out.line(1, "triangleFaces checksum ", checksum(mesh.triangleFaces));
    }
    if (!mesh.triangleMaterials.empty()) {
        out.line(1, "triangleMaterials checksum ", checksum(mesh.triangleMaterials));
    }
    out.line(1, "doubleSided ", text(mesh.doubleSided));
    if (mesh.normals) {
        out.line(1, "normals ", describe(mesh.normals));
    }
    for (const NamedAttribute& primvar : mesh.primvars) {
        out.line(1, "primvar ", text(primvar.name), " ", describe(primvar.attribute));
    }
}

void writeGeometry(Writer& out, const CommittedGeometry& geometry) {
    const Geometry& source = *geometry.source;
    out.line(0, "geometry ", source.path);
    out.line(1, "primId ", text(source.primId));
    out.line(1, "instanced ", text(source.instanced));
    for (std::size_t i = 0; i < source.transforms.size(); ++i) {
        const std::string id =
            i < source.instanceIds.size() ? " id " + text(source.instanceIds[i]) : "";
        out.line(1, "transform ", text(source.transforms[i]), id);
    }
    for (std::size_t slot = 0; slot < geometry.materials.size(); ++slot) {
        out.line(1, "material slot ", text(slot), " is ", text(geometry.materials[slot]), " ",
                 text(source.materials[slot]));
    }
    writeMesh(out, *source.mesh);
}

void writeInput(Writer& out, const char* label, const MaterialInput& input) {
    switch (input.source) {
    case MaterialInput::Source::kConstant:
        out.line(1, label, " ", text(input.value));
        break;
    case MaterialInput::Source::kTexture:
        out.line(1, label, " texture ", text(input.texture), " channel ", text(input.channel));
        break;
    case MaterialInput::Source::kPrimvar:
        out.line(1, label, " primvar ", text(input.primvar), " fallback ", text(input.value));
        break;
    }
}

void writeTexture(Writer& out, std::size_t index, const Material& material) {
    const TextureNode& node = material.textures[index];
    out.line(1, "texture ", text(index), " ", describe(node.image));
    out.line(2, "image ",
             describe(index < material.images.size() ? material.images[index] : nullptr));
    out.line(2, "uv ", text(node.uvPrimvar), " fallback ", text(node.stFallback));
    out.line(2, "wrap ", name(node.wrapS), " ", name(node.wrapT));
    out.line(2, "scale ", text(node.scale));
    out.line(2, "bias ", text(node.bias));
    out.line(2, "fallback ", text(node.fallback));
    out.line(2, "transform scale ", text(node.stScale), " rotation ", text(node.stRotation),
             " translation ", text(node.stTranslation));
}

void writeMaterial(Writer& out, std::size_t index, const Material& m) {
    out.line(0, "material ", text(index), " ", m.path.empty() ? "(default)" : m.path);
    writeInput(out, "diffuseColor", m.diffuseColor);
    writeInput(out, "emissiveColor", m.emissiveColor);
    out.line(1, "useSpecularWorkflow ", text(m.useSpecularWorkflow));
    writeInput(out, "specularColor", m.specularColor);
    writeInput(out, "metallic", m.metallic);
    writeInput(out, "roughness", m.roughness);
    writeInput(out, "clearcoat", m.clearcoat);
    writeInput(out, "clearcoatRoughness", m.clearcoatRoughness);
    writeInput(out, "opacity", m.opacity);
    out.line(1, "opacityMode ",
             m.opacityMode == OpacityMode::kTransparent ? "transparent" : "presence");
    writeInput(out, "opacityThreshold", m.opacityThreshold);
    writeInput(out, "ior", m.ior);
    writeInput(out, "normal", m.normal);
    for (std::size_t i = 0; i < m.textures.size(); ++i) {
        writeTexture(out, i, m);
    }
}

void writeShape(Writer& out, const Light& light) {
    switch (light.type) {
    case LightType::kRect:
        out.line(1, "size ", text(light.width), " ", text(light.height));
        break;
    case LightType::kDisk:
        out.line(1, "radius ", text(light.radius));
        break;
    case LightType::kSphere:
        out.line(1, "radius ", text(light.radius), " treatAsPoint ", text(light.treatAsPoint));
        break;
    case LightType::kCylinder:
        out.line(1, "radius ", text(light.radius), " length ", text(light.length), " treatAsLine ",
                 text(light.treatAsLine));
        break;
    case LightType::kDistant:
        out.line(1, "angle ", text(light.angle));
        break;
    case LightType::kDome:
        out.line(1, "visibleToCamera ", text(light.visibleToCamera));
        break;
    }
}

void writeLight(Writer& out, const Light& light) {
    out.line(0, "light ", light.path, " ", name(light.type),
             light.isCameraLight ? " camera light" : "");
    out.line(1, "transform ", text(light.toWorld));
    out.line(1, "radiance ", text(light.radiance));
    out.line(1, "diffuse ", text(light.diffuse), " specular ", text(light.specular));
    out.line(1, "normalize ", text(light.normalize));
    writeShape(out, light);
    if (!light.castsShadows) {
        out.line(1, "castsShadows ", text(light.castsShadows));
    }
    if (light.shaping.isOn()) {
        out.line(1, "shaping focus ", text(light.shaping.focus), " tint ",
                 text(light.shaping.focusTint), " cone ", text(light.shaping.coneAngle),
                 " softness ", text(light.shaping.coneSoftness));
    }
    if (light.hasTexture) {
        out.line(1, "texture ", describe(light.texture), " image ", describe(light.image));
    }
}

} // namespace

std::string dumpScene(const Scene& scene) {
    Writer out;
    out.line(0, "origin ", text(scene.origin()));
    for (const CommittedGeometry& geometry : scene.geometries()) {
        writeGeometry(out, geometry);
    }
    for (std::size_t i = 0; i < scene.materials().size(); ++i) {
        writeMaterial(out, i, *scene.materials()[i]);
    }
    for (const std::shared_ptr<const Light>& light : scene.lights()) {
        writeLight(out, *light);
    }
    return out.take();
}

} // namespace mbfeat
