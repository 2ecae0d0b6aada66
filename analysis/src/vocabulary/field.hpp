// One event's fields as a reader found them: what vocabularies translate. Both readers fill these,
// so that a vocabulary knows names and meanings only.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/tracepoints/schema.hpp>

#include "fixed_field.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace cie::analysis {

// A value in a slot that a vocabulary asked for. What is of no use to vocabularies (a real number,
// a structure) reads as absent. Views live as long as the event is being consumed.
struct Field {
  enum class Kind : std::uint8_t { absent, integer, text, integers };
  Kind kind = Kind::absent;
  std::int16_t label = -1;   // index among the labels asked for; -1: none of them
  std::uint32_t length = 0;  // characters of a text, elements of integers, bits of an integer
  union {
    std::int64_t number = 0;  // integers and enumerations; above int64 it wraps
    const char* characters;
    const std::uint32_t* elements;
  };
};

// What a vocabulary asks for: a name, or alternatives "prev_tid|prev_pid" of which the first one
// present counts, and the labels if it is an enumeration of the contract.
//
// An absent field is unknown, never 0. So a number is needed unless the model has a value for
// "unknown" or "none": a class of events without it is of no vocabulary, and what asks for such
// events finds none. A text, a label and an id that may be "none" are not needed, but what names
// something is.
struct FieldRequest {
  // Implicit: tables of requests are lists of names. NOLINTNEXTLINE(google-explicit-constructor)
  constexpr FieldRequest(const char* field_names) : names(field_names) {}
  constexpr FieldRequest(std::string_view field_names, std::span<const std::string_view> wanted)
      : names(field_names), labels(wanted) {}

  // Whether `name` is the n-th alternative; empty if it is none.
  constexpr std::optional<std::size_t> alternative(std::string_view name) const noexcept {
    std::size_t number = 0;
    for (auto rest = names; !rest.empty(); ++number) {
      const auto bar = rest.find('|');
      if (rest.substr(0, bar) == name) return number;
      if (bar == std::string_view::npos) break;
      rest.remove_prefix(bar + 1);
    }
    return std::nullopt;
  }

  std::string_view names;
  std::span<const std::string_view> labels;
  bool is_needed = false;
};

constexpr FieldRequest needed(FieldRequest request) {
  request.is_needed = true;
  return request;
}

template <typename Enum>
constexpr FieldRequest labelled(std::string_view name) {
  return {name, Labels<Enum>::kValues};
}

// Slots of an event, in the order in which its translation asks for them.
inline constexpr std::size_t kMaxSlots = 16;

// The few ways in which vocabularies read fields: those that a reader has collected, or where they
// lie in memory.
class Payload {
 public:
  // Borrowed, one per slot.
  explicit Payload(const Field* fields) noexcept : fields_(fields) {}
  Payload(const std::uint8_t* begin, const FixedField* fixed) noexcept
      : begin_(begin), fixed_(fixed) {}
  // Of another event of the same layout.
  void move_to(const std::uint8_t* begin) noexcept { begin_ = begin; }

  std::optional<std::int64_t> integer(std::size_t slot) const noexcept {
    if (fixed_ != nullptr) {
      const auto& field = fixed_[slot];
      if (field.kind != FixedField::Kind::integer) return std::nullopt;
      return static_cast<std::int64_t>(field.load(begin_));
    }
    const auto& field = fields_[slot];
    if (field.kind != Field::Kind::integer) return std::nullopt;
    return field.number;
  }
  // 0 where the trace has no such field: of one that is needed, or where 0 is "unknown" or "none".
  template <typename Integer>
  Integer number(std::size_t slot) const noexcept {
    if (fixed_ != nullptr) return fixed_[slot].load_as<Integer>(begin_);
    const auto& field = fields_[slot];
    return field.kind == Field::Kind::integer ? static_cast<Integer>(field.number) : Integer{0};
  }
  template <typename Integer>
  Integer number(std::size_t slot, Integer absent) const noexcept {
    const auto value = integer(slot);
    return value ? static_cast<Integer>(*value) : absent;
  }
  template <typename Integer>
  std::optional<Integer> optional(std::size_t slot) const noexcept {
    const auto value = integer(slot);
    return value ? std::optional(static_cast<Integer>(*value)) : std::nullopt;
  }
  // An id of the contract; "none" where the trace has no such field.
  template <typename Id>
  Id id(std::size_t slot) const noexcept {
    return static_cast<Id>(number<std::uint32_t>(slot, kNoId));
  }
  std::string_view text(std::size_t slot) const noexcept {
    if (fixed_ != nullptr) {
      const auto& field = fixed_[slot];
      return field.kind == FixedField::Kind::text ? field.text(begin_) : std::string_view{};
    }
    const auto& field = fields_[slot];
    if (field.kind != Field::Kind::text) return {};
    return {field.characters, field.length};
  }
  std::span<const std::uint32_t> integers(std::size_t slot) const noexcept {
    if (fixed_ != nullptr) return {};  // never at a fixed place
    const auto& field = fields_[slot];
    if (field.kind != Field::Kind::integers) return {};
    return {field.elements, field.length};
  }
  template <typename Enum>
  std::optional<Enum> label(std::size_t slot) const noexcept {
    const auto index = label_index(slot);
    return index >= 0 ? std::optional(static_cast<Enum>(index)) : std::nullopt;
  }

 private:
  std::int16_t label_index(std::size_t slot) const noexcept {
    if (fixed_ == nullptr) return fields_[slot].label;
    const auto& field = fixed_[slot];
    return field.labels != nullptr ? field.labels->find(field.load(begin_)) : std::int16_t{-1};
  }

  const Field* fields_ = nullptr;
  const std::uint8_t* begin_ = nullptr;
  const FixedField* fixed_ = nullptr;
};

// Elements of a sequence beyond these are not read.
inline constexpr std::size_t kMaxElements = 65'536;

}  // namespace cie::analysis
