// Typed access to VtValues of scene data, which come in whatever type was authored.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pxr/pxr.h"

#include "core/settings.h"
#include "core/vec.h"
#include "pxr/base/vt/dictionary.h"
#include "pxr/base/vt/value.h"
#include "scene/meshBuilder.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

/// The number in a bool, an integer or a floating-point value of any width.
std::optional<double> asNumber(const VtValue& value);
float asFloat(const VtValue& value, float fallback);
bool asBool(const VtValue& value, bool fallback);

/// A colour or vector: three or four components, or a number in all three.
std::optional<Float3> asFloat3(const VtValue& value);
std::optional<Float4> asFloat4(const VtValue& value);
std::optional<Float2> asFloat2(const VtValue& value);

/// The text of a token, string or asset path (resolved, or as authored where it did not resolve).
std::optional<std::string> asText(const VtValue& value);

/// A setting's value; nothing for types that no setting has.
std::optional<SettingValue> asSetting(const VtValue& value);
VtValue toVtValue(const SettingValue& value);

/// The value of a key such as "driver:parameters:aov:name", which a host may hand over flat or as
/// dictionaries within dictionaries.
VtValue findSettingValue(const VtDictionary& settings, const std::string& key);

/// All values by their full names, dictionaries within dictionaries joined with colons.
std::map<std::string, VtValue> flattened(const VtDictionary& settings);

/// A value as text for people and file headers.
std::string describe(const VtValue& value);

/// Floats behind a primvar's value: the array itself where it holds floats, else a converted copy.
/// The view lives as long as this object.
class FloatArray {
public:
    FloatArray() = default;
    /// Arrays and single values of one to four components; anything else is empty with width 0.
    explicit FloatArray(const VtValue& value);

    int width() const { return width_; }
    ArrayView<float> view() const;

private:
    template <class T>
    bool take(const VtValue& value, int width);
    template <class T, class Scalar>
    bool convert(const VtValue& value, int width);

    VtValue keepAlive_;
    std::vector<float> converted_;
    const float* data_ = nullptr;
    std::size_t size_ = 0;
    int width_ = 0;
};

} // namespace mbfeat
