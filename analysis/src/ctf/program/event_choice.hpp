// Which classes of events somebody wants to see as they are, whatever vocabularies know of them.
#pragma once

#include "shown_fields.hpp"

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace cie::analysis::ctf {

// Filled while metadata are read, and constant then: it owns what events view of their classes.
class EventChoice {
 public:
  // Whether classes of that name are wanted; `has_fields`: with their fields.
  EventChoice(std::function<bool(std::string_view)> wants, bool has_fields)
      : wants_(std::move(wants)), has_fields_(has_fields) {}
  EventChoice(const EventChoice&) = delete;
  EventChoice& operator=(const EventChoice&) = delete;

  // Classes of one name, of whatever trace, have one number. Empty: they are not wanted.
  std::optional<std::uint32_t> number(const std::string& name) {
    if (const auto known = numbers_.find(name); known != numbers_.end()) return known->second;
    std::optional<std::uint32_t> number;
    if (wants_(name)) {
      number = static_cast<std::uint32_t>(names_.size());
      names_.push_back(name);
    }
    return numbers_.emplace(name, number).first->second;
  }
  bool has_fields() const noexcept { return has_fields_; }
  // What fields shown belong to.
  void keep(TypeRef type) { types_.push_back(std::move(type)); }
  const ShownField* keep(ShownField field) { return &fields_.emplace_back(std::move(field)); }

  // Of those wanted, by number; and of all that were declared.
  const std::deque<std::string>& names() const noexcept { return names_; }
  const auto& declared() const noexcept { return numbers_; }

 private:
  std::function<bool(std::string_view)> wants_;
  bool has_fields_;
  std::map<std::string, std::optional<std::uint32_t>> numbers_;
  std::deque<std::string> names_;
  std::deque<ShownField> fields_;
  std::deque<TypeRef> types_;
};

}  // namespace cie::analysis::ctf
