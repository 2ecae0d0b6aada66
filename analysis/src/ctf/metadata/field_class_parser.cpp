#include "field_class_parser.hpp"

#include "type_limits.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <utility>

namespace cie::analysis::ctf {
namespace {

constexpr std::uint64_t kMaxBits = 65'536;  // of what is no number

constexpr std::array kRoles{
    std::pair("packet-magic-number", Role::magic),
    std::pair("metadata-stream-uuid", Role::metadata_uuid),
    std::pair("data-stream-class-id", Role::stream_class),
    std::pair("data-stream-id", Role::stream_instance),
    std::pair("packet-total-length", Role::packet_size),
    std::pair("packet-content-length", Role::content_size),
    std::pair("default-clock-timestamp", Role::time),
    std::pair("packet-end-default-clock-timestamp", Role::packet_end_time),
    std::pair("discarded-event-record-counter-snapshot", Role::discarded_events),
    std::pair("packet-sequence-number", Role::packet_sequence),
    std::pair("event-record-class-id", Role::event_class)};

constexpr std::array kOrigins{std::pair("packet-header", "trace.packet.header"),
                              std::pair("packet-context", "stream.packet.context"),
                              std::pair("event-record-header", "stream.event.header"),
                              std::pair("event-record-common-context", "stream.event.context"),
                              std::pair("event-record-specific-context", "event.context"),
                              std::pair("event-record-payload", "event.fields")};

std::string shown(const std::string& text) { return '"' + text.substr(0, kShown) + '"'; }

template <typename Table>
auto find_in(const Table& table, const std::string& name, const char* what) {
  const auto found =
      std::ranges::find_if(table, [&name](const auto& entry) { return name == entry.first; });
  if (found == table.end()) throw MetadataError(std::string(what) + ' ' + shown(name));
  return found->second;
}

std::vector<Role> roles_of(const Json& field_class) {
  std::vector<Role> roles;
  const auto* names = array_property(field_class, "roles");
  if (names == nullptr) return roles;
  for (const auto& name : *names) {
    if (!name.is_string()) throw MetadataError("\"roles\" must be strings");
    const auto role = find_in(kRoles, name.get<std::string>(), "unknown role");
    if (std::ranges::find(roles, role) == roles.end()) roles.push_back(role);
  }
  return roles;
}

void refuse_roles(const Type& type) {
  const bool is_number_without =
      type.is_signed || (type.kind != Type::Kind::integer && type.kind != Type::Kind::enumeration &&
                         type.kind != Type::Kind::leb128);
  const bool has_other =
      std::ranges::any_of(type.roles, [](Role role) { return role == Role::metadata_uuid; });
  if (!type.roles.empty() && (is_number_without || has_other)) {
    throw MetadataError("a field has a role that its class cannot have");
  }
  const bool is_magic = std::ranges::find(type.roles, Role::magic) != type.roles.end();
  if (is_magic && (type.size != 32 || type.kind == Type::Kind::leb128)) {
    throw MetadataError("a magic number must have 32 bits");
  }
}

std::uint32_t alignment_of(const Json& field_class, const char* name) {
  const auto bits = unsigned_property(field_class, name, 1);
  if (!is_alignment(bits)) {
    throw MetadataError("an alignment must be a power of two up to 32768");
  }
  return static_cast<std::uint32_t>(bits);
}

// How numbers look is no reason to refuse a trace: what makes no sense is as if it were not there.
bool is_shown_hexadecimal(const Json& field_class) {
  const auto base = field_class.find("preferred-display-base");
  return base != field_class.end() && base->is_number_integer() && *base == 16;
}

// Passes the ranges of a set on: lower and upper bound.
template <typename Take>
void each_range(const Json& set, Take&& take) {
  if (!set.is_array() || set.empty()) throw MetadataError("a set of ranges must be a filled array");
  for (const auto& range : set) {
    if (!range.is_array() || range.size() != 2) throw MetadataError("a range must have two bounds");
    const auto low = integer_of(range[0]);
    const auto high = integer_of(range[1]);
    if (low > high) throw MetadataError("a range ends before it begins");
    take(low, high);
  }
}

// Labels; of a range what the integer can have.
void read_mappings(const Json& field_class, Type& type) {
  const auto* mappings = object_property(field_class, "mappings");
  if (mappings == nullptr) return;
  for (const auto& [label, set] : mappings->items()) {
    each_range(set, [&, &name = label](WideInteger low, WideInteger high) {
      if (const auto range = representable(low, high, type.is_signed)) {
        type.ranges.push_back({.label = name, .low = range->first, .high = range->second});
      }
    });
  }
  if (type.kind == Type::Kind::integer) type.kind = Type::Kind::enumeration;
}

std::shared_ptr<const FieldLocation> location_of(const Json& field_class, const char* name) {
  const auto& object = property(field_class, name);
  FieldLocation location;
  if (const auto origin = text_property(object, "origin", ""); !origin.empty()) {
    location.origin = find_in(kOrigins, origin, "unknown origin");
  }
  const auto* path = array_property(object, "path");
  if (path == nullptr || path->empty() || path->back().is_null()) {
    throw MetadataError("a path must end with the name of a field");
  }
  for (const auto& step : *path) {
    if (!step.is_string() && !step.is_null()) throw MetadataError("a path has names and nulls");
    location.path.push_back(step.is_null() ? std::nullopt : std::optional(step.get<std::string>()));
  }
  return std::make_shared<const FieldLocation>(std::move(location));
}

void add_selections(const Json& object, std::size_t option, Type& type) {
  each_range(property(object, "selector-field-ranges"), [&](WideInteger low, WideInteger high) {
    type.selections.push_back({.option = option, .low = low, .high = high});
  });
}

Type byte() {
  Type type{.kind = Type::Kind::integer};
  type.align = 8;
  type.size = 8;
  type.byte_order = ByteOrder::little;
  return type;
}

// Bytes of a known number, or as many as a field says.
Type bytes(const Json& field_class, bool is_dynamic, TypeRef element) {
  Type type{.kind = is_dynamic ? Type::Kind::sequence : Type::Kind::array};
  type.align = 8;
  type.element = std::move(element);
  if (is_dynamic) {
    type.location = location_of(field_class, "length-field-location");
  } else {
    type.length = unsigned_property(field_class, "length");
  }
  return type;
}

TypeRef finish(Type type) {
  type.depth = depth_of(type);
  if (type.depth > kMaxNesting) throw MetadataError("types are nested too deeply");
  return std::make_shared<const Type>(std::move(type));
}

}  // namespace

void FieldClassParser::add_alias(const std::string& name, const Json& field_class) {
  if (!aliases_.emplace(name, type_of(field_class)).second) {
    throw MetadataError("a second alias " + shown(name));
  }
}

TypeRef FieldClassParser::type_of(const Json& field_class) const {
  if (!field_class.is_string()) return read(field_class);
  const auto name = field_class.get<std::string>();
  const auto found = aliases_.find(name);
  if (found == aliases_.end()) throw MetadataError("unknown field class " + shown(name));
  return found->second;
}

TypeRef FieldClassParser::structure_of(const Json& object, const char* property_name) const {
  const auto* field_class = find_property(object, property_name);
  if (field_class == nullptr) return nullptr;
  auto type = type_of(*field_class);
  if (type->kind != Type::Kind::structure) {
    throw MetadataError(std::string("\"") + property_name + "\" must be a structure");
  }
  return type;
}

TypeRef FieldClassParser::read(const Json& field_class) const {
  const auto kind = text_property(field_class, "type");
  refuse_extensions(field_class);
  if (kind.starts_with("fixed-length-")) return finish(bit_array(field_class, kind));
  if (kind.starts_with("variable-length-")) return finish(leb128(field_class, kind));
  if (kind.ends_with("-string")) return finish(text(field_class, kind));
  if (kind.ends_with("-blob")) return finish(blob(field_class, kind));
  if (kind.ends_with("-array")) return finish(array(field_class, kind));
  if (kind == "structure") return finish(structure(field_class));
  if (kind == "optional") return finish(optional(field_class));
  if (kind == "variant") return finish(variant(field_class));
  throw MetadataError("unknown field class " + shown(kind));
}

Type FieldClassParser::bit_array(const Json& field_class, const std::string& kind) const {
  constexpr std::array kKinds{std::pair("fixed-length-bit-array", Type::Kind::bits),
                              std::pair("fixed-length-bit-map", Type::Kind::bits),
                              std::pair("fixed-length-boolean", Type::Kind::boolean),
                              std::pair("fixed-length-unsigned-integer", Type::Kind::integer),
                              std::pair("fixed-length-signed-integer", Type::Kind::integer),
                              std::pair("fixed-length-floating-point-number", Type::Kind::real)};
  Type type{.kind = find_in(kKinds, kind, "unknown field class")};
  const auto length = unsigned_property(field_class, "length");
  if (length == 0 || length > kMaxBits) {
    throw MetadataError("a field must have 1 to " + std::to_string(kMaxBits) + " bits");
  }
  const bool is_real_length =
      length == 16 || length == 32 || length == 64 || (length >= 128 && length % 32 == 0);
  if (type.kind == Type::Kind::real && !is_real_length) {
    throw MetadataError("a floating point number of no known size");
  }
  type.size = static_cast<std::uint32_t>(length);
  type.align = alignment_of(field_class, "alignment");
  const auto byte_order = text_property(field_class, "byte-order");
  if (byte_order != "little-endian" && byte_order != "big-endian") {
    throw MetadataError("unknown byte order " + shown(byte_order));
  }
  const bool is_big = byte_order == "big-endian";
  type.byte_order = is_big ? ByteOrder::big : ByteOrder::little;
  const auto usual = is_big ? "last-to-first" : "first-to-last";
  const auto bit_order = text_property(field_class, "bit-order", usual);
  if (bit_order != "first-to-last" && bit_order != "last-to-first") {
    throw MetadataError("unknown bit order " + shown(bit_order));
  }
  type.is_reversed = bit_order != usual;
  type.is_signed = kind == "fixed-length-signed-integer";
  if (type.kind == Type::Kind::integer) {
    read_mappings(field_class, type);
    type.is_hexadecimal = is_shown_hexadecimal(field_class);
  }
  // What is longer than any number is skipped.
  if (length > kMaxIntegerBits) type.kind = Type::Kind::real;
  type.roles = roles_of(field_class);
  refuse_roles(type);
  return type;
}

Type FieldClassParser::leb128(const Json& field_class, const std::string& kind) const {
  Type type{.kind = Type::Kind::leb128};
  type.align = 8;
  type.is_signed = kind == "variable-length-signed-integer";
  if (!type.is_signed && kind != "variable-length-unsigned-integer") {
    throw MetadataError("unknown field class " + shown(kind));
  }
  read_mappings(field_class, type);
  type.roles = roles_of(field_class);
  refuse_roles(type);
  return type;
}

Type FieldClassParser::text(const Json& field_class, const std::string& kind) const {
  constexpr std::array kWidths{std::pair("utf-8", 8U), std::pair("utf-16be", 16U),
                               std::pair("utf-16le", 16U), std::pair("utf-32be", 32U),
                               std::pair("utf-32le", 32U)};
  const auto width =
      find_in(kWidths, text_property(field_class, "encoding", "utf-8"), "unknown encoding");
  Type type{.kind = Type::Kind::string};
  if (kind == "null-terminated-string") {
    type.align = 8;
    type.size = width;
  } else if (kind == "static-length-string" || kind == "dynamic-length-string") {
    auto character = byte();
    character.is_text = true;
    type = bytes(field_class, kind.starts_with("dynamic"), finish(std::move(character)));
  } else {
    throw MetadataError("unknown field class " + shown(kind));
  }
  type.is_wide_text = width > 8;
  return type;
}

Type FieldClassParser::blob(const Json& field_class, const std::string& kind) const {
  if (kind != "static-length-blob" && kind != "dynamic-length-blob") {
    throw MetadataError("unknown field class " + shown(kind));
  }
  auto type = bytes(field_class, kind.starts_with("dynamic"), finish(byte()));
  type.roles = roles_of(field_class);
  const bool is_uuid = type.kind == Type::Kind::array && type.length == 16;
  const bool has_other =
      std::ranges::any_of(type.roles, [](Role role) { return role != Role::metadata_uuid; });
  if (has_other || (!type.roles.empty() && !is_uuid)) {
    throw MetadataError("a field has a role that its class cannot have");
  }
  return type;
}

Type FieldClassParser::structure(const Json& field_class) const {
  Type type{.kind = Type::Kind::structure};
  type.align = alignment_of(field_class, "minimum-alignment");
  const auto* members = array_property(field_class, "member-classes");
  if (members == nullptr) return type;
  std::set<std::string> names;
  for (const auto& member : *members) {
    auto name = text_property(member, "name");
    refuse_extensions(member);
    if (!names.insert(name).second) throw MetadataError("a second field " + shown(name));
    auto member_type = type_of(property(member, "field-class"));
    type.align = std::max(type.align, member_type->align);
    type.members.push_back({.name = std::move(name), .type = std::move(member_type)});
  }
  return type;
}

Type FieldClassParser::array(const Json& field_class, const std::string& kind) const {
  Type type{.kind = Type::Kind::array};
  type.element = type_of(property(field_class, "element-field-class"));
  type.align = std::max(alignment_of(field_class, "minimum-alignment"), type.element->align);
  if (kind == "static-length-array") {
    type.length = unsigned_property(field_class, "length");
  } else if (kind == "dynamic-length-array") {
    type.kind = Type::Kind::sequence;
    type.location = location_of(field_class, "length-field-location");
  } else {
    throw MetadataError("unknown field class " + shown(kind));
  }
  return type;
}

Type FieldClassParser::optional(const Json& field_class) const {
  Type type{.kind = Type::Kind::optional};
  type.element = type_of(property(field_class, "field-class"));
  type.location = location_of(field_class, "selector-field-location");
  if (find_property(field_class, "selector-field-ranges") != nullptr) {
    add_selections(field_class, 0, type);
  }
  return type;
}

Type FieldClassParser::variant(const Json& field_class) const {
  Type type{.kind = Type::Kind::variant};
  type.location = location_of(field_class, "selector-field-location");
  const auto* options = array_property(field_class, "options");
  if (options == nullptr || options->empty()) throw MetadataError("a variant without options");
  std::set<std::string> names;
  for (const auto& option : *options) {
    refuse_extensions(option);
    auto name = text_property(option, "name", "");
    if (!name.empty() && !names.insert(name).second) {
      throw MetadataError("a second option " + shown(name));
    }
    add_selections(option, type.members.size(), type);
    type.members.push_back(
        {.name = std::move(name), .type = type_of(property(option, "field-class"))});
  }
  return type;
}

}  // namespace cie::analysis::ctf
