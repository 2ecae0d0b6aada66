// Which fields of a scope fill which slots: by what they are called, by the roles they have, or, in
// an event header of CTF 1.8, by what they mean.
#pragma once

#include "ctf/metadata/types.hpp"
#include "program.hpp"
#include "vocabulary/field.hpp"
#include "vocabulary/label_table.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis::ctf {

// Slots of an event header.
inline constexpr std::size_t kHeaderId = 0;
inline constexpr std::size_t kHeaderTime = 1;

// TSDL marks names that its tracer did not choose with an underscore.
std::string_view plain_name(std::string_view name);

// What a field is asked for.
struct Want {
  std::vector<std::int16_t> slots{};  // empty: nobody asks
  std::span<const std::string_view> labels{};

  std::int16_t first() const { return slots.empty() ? kNone : slots.front(); }
};

// The labels that somebody asks for by their places among them, where a value of the type has one;
// a plain integer goes by number.
LabelTable label_table_of(const Type& type, std::span<const std::string_view> labels);

class Wants {
 public:
  // `roles` by slot, where metadata have roles; an event header without them goes by meaning.
  Wants(bool has_roles, bool is_header, std::span<const Role> roles)
      : has_roles_(has_roles), is_header_(is_header) {
    if (has_roles) roles_ = roles;
  }

  // The name that requests know a field by.
  std::string_view requested_name(std::string_view name) const {
    return has_roles_ ? name : plain_name(name);
  }
  // By member of the scope: those of a request's alternatives are the first that there is.
  std::vector<Want> by_name(const Type& scope, std::span<const FieldRequest> requests) const;
  // What a field is asked for if `by_name` is what it is by its name.
  Want of_field(const std::string& name, const Type& type, const Want& by_name) const;

 private:
  bool has_roles_;
  bool is_header_;
  std::span<const Role> roles_;
};

}  // namespace cie::analysis::ctf
