#include "scene/meshAttributes.h"

#include <cmath>
#include <cstring>

namespace mbfeat {

namespace {

const char* interpolationName(RawInterpolation interpolation) {
    switch (interpolation) {
    case RawInterpolation::kConstant:
        return "constant";
    case RawInterpolation::kUniform:
        return "uniform";
    case RawInterpolation::kVarying:
        return "varying";
    case RawInterpolation::kVertex:
        return "vertex";
    case RawInterpolation::kFaceVarying:
        break;
    }
    return "faceVarying";
}

/// Number of elements that the interpolation calls for.
std::size_t expectedCount(RawInterpolation interpolation, const MeshTopology& topology) {
    switch (interpolation) {
    case RawInterpolation::kConstant:
        return 1;
    case RawInterpolation::kUniform:
        return topology.faces;
    case RawInterpolation::kVarying:
    case RawInterpolation::kVertex:
        return topology.points;
    case RawInterpolation::kFaceVarying:
        break;
    }
    return topology.faceVertices;
}

/// Values of an attribute through its indices, if it has any.
class ValueReader {
public:
    explicit ValueReader(const RawAttribute& raw)
        : raw_(raw),
          width_(static_cast<std::size_t>(raw.width)) {}

    std::size_t valueIndex(std::size_t element) const {
        return raw_.indexed ? static_cast<std::size_t>(raw_.indices[element]) : element;
    }
    const float* value(std::size_t index) const { return raw_.values.data + index * width_; }
    bool differ(std::size_t a, std::size_t b) const {
        return a != b && std::memcmp(value(a), value(b), width_ * sizeof(float)) != 0;
    }
    void copy(std::size_t index, float* out) const {
        for (std::size_t c = 0; c < width_; ++c) {
            out[c] = value(index)[c];
        }
    }

private:
    const RawAttribute& raw_;
    std::size_t width_;
};

/// What is wrong with the numbers of values and indices, or "".
std::string sizeProblem(const RawAttribute& raw, const MeshTopology& topology) {
    const auto width = static_cast<std::size_t>(raw.width);
    const std::size_t count = raw.values.size / width;
    if (raw.values.size % width != 0 || count == 0) {
        return raw.values.empty() ? "has no values" : "has an incomplete last value";
    }
    const std::size_t elements = raw.indexed ? raw.indices.size : count;
    const std::size_t expected = expectedCount(raw.interpolation, topology);
    const bool constant = raw.interpolation == RawInterpolation::kConstant;
    const bool fits = elements == expected || (constant && elements > 0) ||
                      (raw.interpolation == RawInterpolation::kFaceVarying &&
                       elements == topology.countedFaceVertices);
    if (!fits) {
        return "has " + std::to_string(elements) + (raw.indexed ? " indices" : " values") +
               ", but " + interpolationName(raw.interpolation) + " interpolation needs " +
               std::to_string(expected);
    }
    if (raw.indexed) {
        for (const int index : raw.indices) {
            if (index < 0 || static_cast<std::size_t>(index) >= count) {
                return "has the index " + std::to_string(index) + ", but " + std::to_string(count) +
                       " values";
            }
        }
    }
    return {};
}

/// Tries to give face-varying values to points: possible where all corners at a point agree.
bool collapseToPoints(const ValueReader& reader, const MeshTopology& topology, Attribute& out) {
    constexpr std::uint32_t kNone = ~std::uint32_t(0);
    std::vector<std::uint32_t> chosen(topology.points, kNone);
    const std::vector<Triangle>& triangles = *topology.triangles;
    const std::vector<Triangle>& corners = *topology.corners;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        for (int k = 0; k < 3; ++k) {
            const std::size_t index = reader.valueIndex(corners[t].v[k]);
            std::uint32_t& first = chosen[triangles[t].v[k]];
            if (first == kNone) {
                first = static_cast<std::uint32_t>(index);
            } else if (reader.differ(first, index)) {
                return false;
            }
        }
    }
    const auto width = static_cast<std::size_t>(out.width);
    out.interpolation = Interpolation::kVertex;
    out.values.assign(topology.points * width, 0.0F);
    for (std::size_t p = 0; p < topology.points; ++p) {
        if (chosen[p] != kNone) {
            reader.copy(chosen[p], out.values.data() + p * width);
        }
    }
    return true;
}

void flattenFaceVarying(const ValueReader& reader, const MeshTopology& topology, Attribute& out) {
    if (collapseToPoints(reader, topology, out)) {
        return;
    }
    const auto width = static_cast<std::size_t>(out.width);
    const std::vector<Triangle>& corners = *topology.corners;
    out.interpolation = Interpolation::kFaceVarying;
    out.values.resize(corners.size() * 3 * width);
    float* to = out.values.data();
    for (const Triangle& corner : corners) {
        for (const std::uint32_t c : corner.v) {
            reader.copy(reader.valueIndex(c), to);
            to += width;
        }
    }
}

void gather(const RawAttribute& raw, const ValueReader& reader, std::size_t count, Attribute& out) {
    const auto width = static_cast<std::size_t>(out.width);
    if (!raw.indexed) {
        out.values.assign(raw.values.begin(), raw.values.begin() + count * width);
        return;
    }
    out.values.resize(count * width);
    for (std::size_t i = 0; i < count; ++i) {
        reader.copy(reader.valueIndex(i), out.values.data() + i * width);
    }
}

/// Number of values that were not finite and now are zero.
std::size_t zeroNonFinite(std::vector<float>& values) {
    // A sum of zeros unless something is not finite: this pass is vectorised.
    float probe = 0.0F;
    for (const float value : values) {
        probe += value * 0.0F;
    }
    if (probe == 0.0F) {
        return 0;
    }
    std::size_t count = 0;
    for (float& value : values) {
        if (!std::isfinite(value)) {
            value = 0.0F;
            ++count;
        }
    }
    return count;
}

/// arccos for x in [-1, 1] to 7e-5 (Abramowitz and Stegun 4.4.45): enough for a weight.
float fastAcos(float x) {
    const float a = std::abs(x);
    const float p = sqrt(max(1.0F - a, 0.0F)) *
                    fma(a, fma(a, fma(a, -0.0187293F, 0.0742610F), -0.2121144F), 1.5707288F);
    return x < 0.0F ? kPi - p : p;
}

} // namespace

Attribute buildAttribute(const RawAttribute& raw, const MeshTopology& topology,
                         const std::string& subject, Diagnostics& diagnostics) {
    if (raw.width < 1 || raw.width > 4) {
        return {};
    }
    const std::string problem = sizeProblem(raw, topology);
    if (!problem.empty()) {
        diagnostics.warn(subject, "primvar '" + raw.name + "' " + problem + "; it is not used");
        return {};
    }
    Attribute out;
    out.width = raw.width;
    const ValueReader reader(raw);
    switch (raw.interpolation) {
    case RawInterpolation::kConstant:
        out.interpolation = Interpolation::kConstant;
        if ((raw.indexed ? raw.indices.size
                         : raw.values.size / static_cast<std::size_t>(raw.width)) > 1) {
            diagnostics.warn(subject,
                             "primvar '" + raw.name +
                                 "' is constant but has several values; the first is used");
        }
        gather(raw, reader, 1, out);
        break;
    case RawInterpolation::kUniform:
        out.interpolation = Interpolation::kUniform;
        gather(raw, reader, topology.faces, out);
        break;
    case RawInterpolation::kVarying:
    case RawInterpolation::kVertex:
        out.interpolation = Interpolation::kVertex;
        gather(raw, reader, topology.points, out);
        break;
    case RawInterpolation::kFaceVarying:
        flattenFaceVarying(reader, topology, out);
        break;
    }
    if (const std::size_t bad = zeroNonFinite(out.values)) {
        diagnostics.warn(subject, "primvar '" + raw.name + "' has " + std::to_string(bad) +
                                      " numbers that are not finite; they are replaced by zero");
    }
    return out;
}

Attribute smoothNormals(const std::vector<Float3>& points, const std::vector<Triangle>& triangles) {
    std::vector<Float3> sums(points.size(), Float3(0.0F));
    for (const Triangle& triangle : triangles) {
        const Float3& a = points[triangle.v[0]];
        const Float3& b = points[triangle.v[1]];
        const Float3& c = points[triangle.v[2]];
        // Edges scaled to a longest one of 1, so that triangles of any size are safe in float.
        Float3 edges[3] = {b - a, c - b, a - c};
        const float largest = max(maxComponent(abs(edges[0])),
                                  max(maxComponent(abs(edges[1])), maxComponent(abs(edges[2]))));
        const float scale = 1.0F / largest;
        float inverseLengths[3];
        bool good = std::isfinite(scale) && scale > 0.0F;
        for (int k = 0; k < 3; ++k) {
            edges[k] *= scale;
            const float squared = lengthSquared(edges[k]);
            good = good && squared > 0.0F;
            inverseLengths[k] = 1.0F / sqrt(squared);
        }
        const Float3 normal = cross(edges[0], edges[1]);
        const float normalSquared = lengthSquared(normal);
        if (!good || !(normalSquared > 0.0F)) {
            continue;
        }
        const Float3 unit = normal / sqrt(normalSquared);
        for (int k = 0; k < 3; ++k) {
            const int incoming = (k + 2) % 3;
            const float cosine =
                -dot(edges[k], edges[incoming]) * inverseLengths[k] * inverseLengths[incoming];
            sums[triangle.v[k]] += unit * fastAcos(clamp(cosine, -1.0F, 1.0F));
        }
    }
    Attribute normals;
    normals.interpolation = Interpolation::kVertex;
    normals.width = 3;
    normals.values.reserve(points.size() * 3);
    for (const Float3& sum : sums) {
        const float squared = lengthSquared(sum);
        const Float3 n = squared > 0.0F ? sum / sqrt(squared) : Float3(0.0F);
        normals.values.insert(normals.values.end(), {n.x, n.y, n.z});
    }
    return normals;
}

} // namespace mbfeat
