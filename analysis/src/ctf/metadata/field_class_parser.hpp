// Types of CTF 2: its field classes, their aliases and the roles of fields.
#pragma once

#include "fragment_json.hpp"
#include "types.hpp"

#include <map>
#include <string>

namespace cie::analysis::ctf {

// Turns field classes into types. Nesting is bounded; aliases are shared, not copied.
class FieldClassParser {
 public:
  // A field class, or the name of an alias. Throws MetadataError.
  TypeRef type_of(const Json& field_class) const;
  // The structure of a scope; null if the object has no such property.
  TypeRef structure_of(const Json& object, const char* property_name) const;
  void add_alias(const std::string& name, const Json& field_class);

 private:
  TypeRef read(const Json& field_class) const;
  Type bit_array(const Json& field_class, const std::string& kind) const;
  Type leb128(const Json& field_class, const std::string& kind) const;
  Type text(const Json& field_class, const std::string& kind) const;
  Type blob(const Json& field_class, const std::string& kind) const;
  Type structure(const Json& field_class) const;
  Type array(const Json& field_class, const std::string& kind) const;
  Type optional(const Json& field_class) const;
  Type variant(const Json& field_class) const;

  std::map<std::string, TypeRef> aliases_;
};

}  // namespace cie::analysis::ctf
