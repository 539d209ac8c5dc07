// Writing JSON: just what reports need.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mbfeat {

/// The text with every byte that is not part of a well-formed UTF-8 sequence replaced by U+FFFD:
/// file names may hold any bytes, JSON and EXR headers may not.
std::string toValidUtf8(std::string_view text);

/// The shortest decimal text that reads back as the same number, whatever the locale; "nan", "inf"
/// and "-inf" for numbers that are not finite.
std::string toText(double number);

/// Builds one JSON text. The caller keeps to the grammar: inside an object every value follows a
/// key(). Numbers that are not finite become null, which is what JSON has for them.
class JsonWriter {
public:
    JsonWriter& beginObject();
    JsonWriter& endObject();
    JsonWriter& beginArray();
    JsonWriter& endArray();
    JsonWriter& key(std::string_view name);
    JsonWriter& value(std::string_view text);
    JsonWriter& value(const char* text) { return value(std::string_view(text)); }
    JsonWriter& value(double number);
    JsonWriter& value(std::int64_t number);
    JsonWriter& value(std::uint64_t number);
    JsonWriter& value(int number) { return value(static_cast<std::int64_t>(number)); }
    JsonWriter& value(bool truth);
    JsonWriter& value(const std::vector<std::string>& texts);

    const std::string& text() const { return text_; }

private:
    void separate();
    void appendString(std::string_view text);

    std::string text_;
    bool needsComma_ = false;
};

} // namespace mbfeat
