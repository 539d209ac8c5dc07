// The closure inputs of several hits of one material at once: the same bits as evaluateMaterial()
// of each, without a look-up of every path on its own.
#pragma once

#include <array>
#include <cstdint>

#include "core/laneMemory.h"
#include "scene/textureLanes.h"
#include "shading/materialInputs.h"

namespace mbfeat {

/// Hits on one mesh.
template <class T>
struct MeshPlaces {
    IntLane<T> triangle;
    T b1, b2;
};

/// evaluateAttribute() of each lane.
template <class T>
Vec4<T> evaluateAttribute(const Attribute& attribute, const Mesh& mesh,
                          const MeshPlaces<T>& places) {
    std::array<T, 4> result = {T(0), T(0), T(0), T(1)};
    const int width = attribute.width;
    const float* const values = attribute.values.data();
    const auto corner = [&](const IntLane<T>& vertex, int component) {
        return gatherLanes<T>(values + component, vertex * IntLane<T>(width));
    };
    const auto blend = [&](const IntLane<T>& v0, const IntLane<T>& v1, const IntLane<T>& v2) {
        const T b0 = (T(1) - places.b1) - places.b2;
        for (int i = 0; i < width; ++i) {
            result[static_cast<std::size_t>(i)] =
                fma(b0, corner(v0, i), fma(places.b1, corner(v1, i), places.b2 * corner(v2, i)));
        }
    };
    const IntLane<T> first = places.triangle * IntLane<T>(3);
    switch (attribute.interpolation) {
    case Interpolation::kConstant:
        for (int i = 0; i < width; ++i) {
            result[static_cast<std::size_t>(i)] = T(values[i]);
        }
        break;
    case Interpolation::kUniform: {
        const auto* const faces = reinterpret_cast<const std::int32_t*>(mesh.triangleFaces.data());
        const IntLane<T> face = mesh.triangleFaces.empty()
                                    ? places.triangle
                                    : gatherIntLanes<T>(faces, places.triangle);
        for (int i = 0; i < width; ++i) {
            result[static_cast<std::size_t>(i)] = corner(face, i);
        }
        break;
    }
    case Interpolation::kVertex: {
        const auto* const corners = reinterpret_cast<const std::int32_t*>(mesh.triangles.data());
        blend(gatherIntLanes<T>(corners, first), gatherIntLanes<T>(corners + 1, first),
              gatherIntLanes<T>(corners + 2, first));
        break;
    }
    case Interpolation::kFaceVarying:
        blend(first, first + IntLane<T>(1), first + IntLane<T>(2));
        break;
    }
    return {result[0], result[1], result[2], result[3]};
}

/// See evaluateMaterial(); for bindings that are `onLanes`.
template <class T>
class MaterialLanes {
public:
    MaterialLanes(const MaterialBinding& binding, const MeshPlaces<T>& places)
        : binding_(binding),
          places_(places) {}

    /// Puts the varying inputs into the constant ones.
    void evaluate(SurfaceParameters<T>& parameters) {
        for (const MaterialSlot slot : binding_.varying) {
            material::store(slot, input(slot), parameters);
        }
    }

private:
    using Value = Vec3<T>;

    Value input(MaterialSlot slot) {
        const BoundInput& bound = binding_.inputs[static_cast<std::size_t>(slot)];
        if (bound.source == MaterialInput::Source::kTexture) {
            return material::channels(texture(bound.input->texture), bound.input->channel);
        }
        const Vec4<T> v = evaluateAttribute(*bound.primvar, *binding_.mesh, places_);
        return bound.primvar->width == 1 ? Value(v.x) : Value(v.x, v.y, v.z);
    }

    /// Inputs that read other channels of the same texture share one look-up.
    const Vec4<T>& texture(int index) {
        const auto place = static_cast<std::size_t>(index);
        const std::uint32_t bit = 1U << static_cast<unsigned>(index);
        if ((known_ & bit) == 0U) {
            kept_[place] = lookUp(binding_.textures[place]);
            known_ |= bit;
        }
        return kept_[place];
    }

    Vec4<T> lookUp(const BoundTexture& texture) const {
        const TextureNode& node = *texture.node;
        if (texture.image == nullptr) {
            return {T(node.fallback.x), T(node.fallback.y), T(node.fallback.z), T(node.fallback.w)};
        }
        Vec2<T> st(T(node.stFallback.x), T(node.stFallback.y));
        if (texture.uv != nullptr) {
            const Vec4<T> found = evaluateAttribute(*texture.uv, *binding_.mesh, places_);
            st = {found.x, found.y};
        }
        const auto along = [](const Float2& axis) { return Vec2<T>(T(axis.x), T(axis.y)); };
        st = along(texture.x) * st.x + along(texture.y) * st.y + along(texture.translation);
        const Vec4<T> t = sampleTexture(*texture.image, st, node.wrapS, node.wrapT);
        const Float4 &scale = node.scale, &bias = node.bias;
        return {fma(t.x, T(scale.x), T(bias.x)), fma(t.y, T(scale.y), T(bias.y)),
                fma(t.z, T(scale.z), T(bias.z)), fma(t.w, T(scale.w), T(bias.w))};
    }

    const MaterialBinding& binding_;
    const MeshPlaces<T>& places_;
    std::uint32_t known_ = 0;
    std::array<Vec4<T>, kMaterialSlots> kept_;
};

} // namespace mbfeat
