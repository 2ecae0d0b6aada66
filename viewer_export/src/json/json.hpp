// JSON as this project writes it: keys in the order given, hostile strings made valid.
#pragma once

#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace cie::viewer_export {

using Json = nlohmann::ordered_json;

// What no text output would show as it is (is_unprintable()) stands as \uNNNN in every document: it means the same.

// Two spaces of indentation and a final newline. Invalid UTF-8 becomes U+FFFD.
void write_json(std::ostream& out, const Json& document);

// The same on one line.
std::string json_text(const Json& value);
// A string with its quotes, on one line.
std::string json_string(std::string_view text);
// Between quotes it is a JSON string as it is.
bool needs_no_escape(std::string_view text);
// A string with its quotes, appended; most texts need no escapes and are copied.
void append_json_string(std::string& to, std::string_view text);

// Null when empty.
template <typename T>
Json optional_json(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

// Of many keys: to assign them one by one looks each time at all that are there.
Json object_json(const std::map<std::string, std::string>& values);

}  // namespace cie::viewer_export
