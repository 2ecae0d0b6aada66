#include "fragment_json.hpp"

#include <algorithm>
#include <limits>

namespace cie::analysis::ctf {
namespace {

constexpr char kSeparator = '\x1e';
// A fragment takes some thirty times its size while it is looked at.
constexpr std::size_t kMaxFragment = 4U << 20U;
constexpr int kMaxDepth = 256;

std::string quoted(const char* name) { return std::string("\"") + name + "\""; }

[[noreturn]] void fail(const char* name, const char* what) {
  throw MetadataError(quoted(name) + what);
}

Json parse(std::string_view text, std::size_t offset) {
  const auto check_depth = [](int depth, Json::parse_event_t /*event*/, const Json& /*parsed*/) {
    if (depth > kMaxDepth) throw MetadataError("it is nested too deeply");
    return true;
  };
  try {
    return Json::parse(text, check_depth);
  } catch (const Json::parse_error& error) {
    const auto at = error.byte > 0 ? error.byte - 1 : 0;
    const auto where = " at byte " + std::to_string(offset + std::min(at, text.size()));
    throw MetadataError((at >= text.size() ? "it is cut" : "it is no JSON") + where);
  } catch (const Json::exception&) {  // a number beyond all bounds
    throw MetadataError("it is no JSON");
  }
}

}  // namespace

void each_fragment(std::string_view sequence,
                   const std::function<void(std::size_t number, const Json& fragment)>& take) {
  std::size_t number = 0;
  for (auto at = sequence.find(kSeparator); at < sequence.size();) {
    const auto end = std::min(sequence.find(kSeparator, at + 1), sequence.size());
    const auto text = sequence.substr(at + 1, end - at - 1);
    const auto offset = at + 1;
    at = end;
    // RFC 7464 lets separators follow each other.
    if (text.find_first_not_of(kBlank) == std::string_view::npos) continue;
    ++number;
    try {
      if (text.size() > kMaxFragment) throw MetadataError("it is larger than 4 MiB");
      const auto fragment = parse(text, offset);
      if (!fragment.is_object()) throw MetadataError("it is no JSON object");
      take(number, fragment);
    } catch (const MetadataError& error) {
      throw MetadataError("fragment " + std::to_string(number) + ": " + error.what());
    }
  }
}

const Json* find_property(const Json& object, const char* name) {
  if (!object.is_object()) throw MetadataError("an object is missing where one must be");
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

const Json& property(const Json& object, const char* name) {
  const auto* value = find_property(object, name);
  if (value == nullptr) fail(name, " is missing");
  return *value;
}

std::string text_property(const Json& object, const char* name) {
  const auto& value = property(object, name);
  if (!value.is_string()) fail(name, " must be a string");
  return value.get<std::string>();
}

std::string text_property(const Json& object, const char* name, const char* absent) {
  return find_property(object, name) == nullptr ? absent : text_property(object, name);
}

std::uint64_t unsigned_property(const Json& object, const char* name) {
  const auto& value = property(object, name);
  if (!value.is_number_unsigned()) fail(name, " must be an integer, not below 0");
  return value.get<std::uint64_t>();
}

std::uint64_t unsigned_property(const Json& object, const char* name, std::uint64_t absent) {
  return find_property(object, name) == nullptr ? absent : unsigned_property(object, name);
}

std::int64_t signed_property(const Json& object, const char* name, std::int64_t absent) {
  const auto* value = find_property(object, name);
  if (value == nullptr) return absent;
  const bool is_wide = value->is_number_unsigned() &&
                       value->get<std::uint64_t>() >
                           static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (!value->is_number_integer() || is_wide) fail(name, " must be an integer");
  return value->get<std::int64_t>();
}

const Json* array_property(const Json& object, const char* name) {
  const auto* value = find_property(object, name);
  if (value != nullptr && !value->is_array()) fail(name, " must be an array");
  return value;
}

const Json* object_property(const Json& object, const char* name) {
  const auto* value = find_property(object, name);
  if (value != nullptr && !value->is_object()) fail(name, " must be an object");
  return value;
}

WideInteger integer_of(const Json& value) {
  if (value.is_number_unsigned()) return value.get<std::uint64_t>();
  if (value.is_number_integer()) return value.get<std::int64_t>();
  throw MetadataError("an integer is missing where one must be");
}

void refuse_extensions(const Json& object) {
  const auto* namespaces = object_property(object, "extensions");
  if (namespaces == nullptr) return;
  for (const auto& [name, extensions] : namespaces->items()) {
    if (!extensions.is_object()) fail("extensions", " must be an object of objects");
    if (extensions.empty()) continue;
    throw MetadataError("it needs the extension \"" +
                        extensions.items().begin().key().substr(0, kShown) + "\" of \"" +
                        name.substr(0, kShown) + "\", which this reader does not know");
  }
}

}  // namespace cie::analysis::ctf
