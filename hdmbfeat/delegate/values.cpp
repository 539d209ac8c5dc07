#include "delegate/values.h"

#include <cstdint>

#include "delegate/conversions.h"
#include "pxr/base/gf/half.h"
#include "pxr/base/gf/vec2d.h"
#include "pxr/base/gf/vec2h.h"
#include "pxr/base/gf/vec3d.h"
#include "pxr/base/gf/vec3h.h"
#include "pxr/base/gf/vec4d.h"
#include "pxr/base/gf/vec4h.h"
#include "pxr/base/tf/stl.h"
#include "pxr/base/tf/stringUtils.h"
#include "pxr/base/tf/token.h"
#include "pxr/base/vt/array.h"
#include "pxr/usd/sdf/assetPath.h"

namespace mbfeat {

namespace {

template <class T>
bool readNumber(const VtValue& value, double& number) {
    if (!value.IsHolding<T>()) {
        return false;
    }
    number = static_cast<double>(value.UncheckedGet<T>());
    return true;
}

template <class V>
bool readVector(const VtValue& value, double* components, int count) {
    if (!value.IsHolding<V>()) {
        return false;
    }
    const V& v = value.UncheckedGet<V>();
    for (int i = 0; i < count; ++i) {
        components[i] = static_cast<double>(v[i]);
    }
    return true;
}

/// Number of components that were read, 0 for a type without any.
int readComponents(const VtValue& value, double (&c)[4]) {
    if (readVector<GfVec3f>(value, c, 3) || readVector<GfVec3d>(value, c, 3) ||
        readVector<GfVec3h>(value, c, 3)) {
        return 3;
    }
    if (readVector<GfVec4f>(value, c, 4) || readVector<GfVec4d>(value, c, 4) ||
        readVector<GfVec4h>(value, c, 4)) {
        return 4;
    }
    if (readVector<GfVec2f>(value, c, 2) || readVector<GfVec2d>(value, c, 2) ||
        readVector<GfVec2h>(value, c, 2)) {
        return 2;
    }
    if (const std::optional<double> number = asNumber(value)) {
        c[0] = *number;
        return 1;
    }
    return 0;
}

} // namespace

std::optional<double> asNumber(const VtValue& value) {
    double number = 0.0;
    if (readNumber<float>(value, number) || readNumber<double>(value, number) ||
        readNumber<int>(value, number) || readNumber<bool>(value, number) ||
        readNumber<std::int64_t>(value, number) || readNumber<unsigned int>(value, number) ||
        readNumber<std::uint64_t>(value, number) || readNumber<GfHalf>(value, number) ||
        readNumber<unsigned char>(value, number)) {
        return number;
    }
    return std::nullopt;
}

float asFloat(const VtValue& value, float fallback) {
    const std::optional<double> number = asNumber(value);
    return number ? static_cast<float>(*number) : fallback;
}

bool asBool(const VtValue& value, bool fallback) {
    const std::optional<double> number = asNumber(value);
    return number ? *number != 0.0 : fallback;
}

std::optional<Float3> asFloat3(const VtValue& value) {
    double c[4] = {};
    switch (readComponents(value, c)) {
    case 1:
        return Float3(static_cast<float>(c[0]));
    case 3:
    case 4:
        return Float3(static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]));
    default:
        return std::nullopt;
    }
}

std::optional<Float4> asFloat4(const VtValue& value) {
    double c[4] = {};
    const int count = readComponents(value, c);
    if (count < 3) {
        return std::nullopt;
    }
    return Float4(static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]),
                  count == 4 ? static_cast<float>(c[3]) : 1.0F);
}

std::optional<Float2> asFloat2(const VtValue& value) {
    double c[4] = {};
    if (readComponents(value, c) != 2) {
        return std::nullopt;
    }
    return Float2(static_cast<float>(c[0]), static_cast<float>(c[1]));
}

std::optional<std::string> asText(const VtValue& value) {
    if (value.IsHolding<TfToken>()) {
        return value.UncheckedGet<TfToken>().GetString();
    }
    if (value.IsHolding<std::string>()) {
        return value.UncheckedGet<std::string>();
    }
    if (value.IsHolding<SdfAssetPath>()) {
        const SdfAssetPath& path = value.UncheckedGet<SdfAssetPath>();
        return path.GetResolvedPath().empty() ? path.GetAssetPath() : path.GetResolvedPath();
    }
    return std::nullopt;
}

std::optional<SettingValue> asSetting(const VtValue& value) {
    if (value.IsHolding<bool>()) {
        return SettingValue(value.UncheckedGet<bool>());
    }
    if (value.IsHolding<float>() || value.IsHolding<double>() || value.IsHolding<GfHalf>()) {
        return SettingValue(*asNumber(value));
    }
    if (const std::optional<double> number = asNumber(value)) {
        return SettingValue(static_cast<std::int64_t>(*number));
    }
    if (std::optional<std::string> text = asText(value)) {
        return SettingValue(std::move(*text));
    }
    return std::nullopt;
}

VtValue toVtValue(const SettingValue& value) {
    if (const bool* const flag = std::get_if<bool>(&value)) {
        return VtValue(*flag);
    }
    if (const std::int64_t* const integer = std::get_if<std::int64_t>(&value)) {
        return VtValue(static_cast<int>(*integer));
    }
    if (const double* const number = std::get_if<double>(&value)) {
        return VtValue(static_cast<float>(*number));
    }
    return VtValue(std::get<std::string>(value));
}

VtValue findSettingValue(const VtDictionary& settings, const std::string& key) {
    if (const VtValue* const flat = TfMapLookupPtr(settings, key)) {
        return *flat;
    }
    const VtValue* const nested = settings.GetValueAtPath(key, ":");
    return nested != nullptr ? *nested : VtValue();
}

std::map<std::string, VtValue> flattened(const VtDictionary& settings) {
    std::map<std::string, VtValue> found;
    for (const auto& [key, value] : settings) {
        if (!value.IsHolding<VtDictionary>()) {
            found[key] = value;
            continue;
        }
        for (auto& [inner, innerValue] : flattened(value.UncheckedGet<VtDictionary>())) {
            found[key + ":" + inner] = innerValue;
        }
    }
    return found;
}

std::string describe(const VtValue& value) {
    const std::optional<SettingValue> setting = asSetting(value);
    return setting ? toString(*setting) : TfStringify(value);
}

template <class T>
bool FloatArray::take(const VtValue& value, int width) {
    if (value.IsHolding<VtArray<T>>()) {
        keepAlive_ = value;
        const VtArray<T>& array = keepAlive_.UncheckedGet<VtArray<T>>();
        data_ = reinterpret_cast<const float*>(array.cdata());
        size_ = array.size() * static_cast<std::size_t>(width);
    } else if (value.IsHolding<T>()) {
        keepAlive_ = value;
        data_ = reinterpret_cast<const float*>(&keepAlive_.UncheckedGet<T>());
        size_ = static_cast<std::size_t>(width);
    } else {
        return false;
    }
    width_ = width;
    return true;
}

template <class T, class Scalar>
bool FloatArray::convert(const VtValue& value, int width) {
    const T* source = nullptr;
    std::size_t count = 0;
    if (value.IsHolding<VtArray<T>>()) {
        const VtArray<T>& array = value.UncheckedGet<VtArray<T>>();
        source = array.cdata();
        count = array.size();
    } else if (value.IsHolding<T>()) {
        source = &value.UncheckedGet<T>();
        count = 1;
    } else {
        return false;
    }
    const auto* const scalars = reinterpret_cast<const Scalar*>(source);
    converted_.resize(count * static_cast<std::size_t>(width));
    for (std::size_t i = 0; i < converted_.size(); ++i) {
        converted_[i] = static_cast<float>(scalars[i]);
    }
    width_ = width;
    return true;
}

FloatArray::FloatArray(const VtValue& value) {
    const bool known = take<GfVec3f>(value, 3) || take<GfVec2f>(value, 2) ||
                       take<float>(value, 1) || take<GfVec4f>(value, 4) ||
                       convert<GfVec3d, double>(value, 3) || convert<GfVec2d, double>(value, 2) ||
                       convert<double, double>(value, 1) || convert<GfVec4d, double>(value, 4) ||
                       convert<GfVec3h, GfHalf>(value, 3) || convert<GfVec2h, GfHalf>(value, 2) ||
                       convert<GfHalf, GfHalf>(value, 1) || convert<GfVec4h, GfHalf>(value, 4) ||
                       convert<int, int>(value, 1) || convert<bool, bool>(value, 1);
    if (!known) {
        width_ = 0;
    }
}

ArrayView<float> FloatArray::view() const {
    return converted_.empty() ? ArrayView<float>(data_, size_) : ArrayView<float>(converted_);
}

} // namespace mbfeat
