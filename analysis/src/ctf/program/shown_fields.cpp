#include "shown_fields.hpp"

#include "choices.hpp"
#include "vocabulary/field.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>
#include <utility>

namespace cie::analysis::ctf {
namespace {

// The first label that a value has. Of many ranges only the first are looked at, for every event
// that has such a field.
std::string_view label_of(const Type& type, std::uint64_t value) {
  constexpr std::size_t kMaxRanges = 4096;
  const auto bias = bias_of(type);
  for (const auto& range : std::span(type.ranges).first(std::min(type.ranges.size(), kMaxRanges))) {
    const auto number = value ^ bias;
    if (number >= (range.low ^ bias) && number <= (range.high ^ bias)) return range.label;
  }
  return {};
}

}  // namespace

ShownField shown_field(const Type& type, std::string name) {
  using Kind = FieldValue::Kind;
  ShownField field{.kind = Kind::opaque,
                   .name = std::move(name),
                   .size = type.size,
                   .is_hexadecimal = type.is_hexadecimal};
  switch (type.kind) {
    case Type::Kind::boolean:
      field.kind = Kind::boolean;
      break;
    case Type::Kind::real:
      if (type.size == 32 || type.size == 64) field.kind = Kind::real;
      break;
    case Type::Kind::string:
      if (!type.is_wide_text) field.kind = Kind::text;
      break;
    case Type::Kind::structure:
      field.kind = Kind::structure;
      break;
    case Type::Kind::array:
    case Type::Kind::sequence:
      field.kind = Kind::list;
      break;
    default:
      field.kind = type.is_signed ? Kind::integer : Kind::natural;
      if (type.kind != Type::Kind::enumeration && type.ranges.empty()) break;
      field.kind = Kind::label;
      field.type = &type;
  }
  return field;
}

void ShownFields::clear() noexcept {
  values_.clear();
  memory_.release();
  context_ = 0;
  unshown_ = 0;
}

bool ShownFields::has_room() {
  if (values_.size() < kMaxElements) return true;
  constexpr std::string_view kMore = "more";
  const bool is_told = values_.back().name.data() == kMore.data();
  if (!is_told && unshown_ == 0) {
    values_.push_back({.kind = FieldValue::Kind::opaque, .name = kMore});
  }
  return false;
}

void ShownFields::open(const ShownField& field) {
  if (unshown_ == 0 && has_room()) {
    values_.push_back({.kind = field.kind, .name = field.name});
  } else {
    ++unshown_;
  }
}

void ShownFields::close() {
  if (unshown_ > 0) {
    --unshown_;
  } else {
    values_.push_back({.kind = FieldValue::Kind::end, .name = {}});
  }
}

void ShownFields::number(const ShownField& field, std::uint64_t bits) {
  if (!has_room()) return;
  FieldValue value{.kind = field.kind, .is_hexadecimal = field.is_hexadecimal, .name = field.name};
  if (field.kind == FieldValue::Kind::label) {
    value.text = label_of(*field.type, bits);
    // A label is a number with a sign otherwise.
    const bool is_beyond = !field.type->is_signed && static_cast<std::int64_t>(bits) < 0;
    if (is_beyond) value.kind = FieldValue::Kind::natural;
  }
  if (field.kind == FieldValue::Kind::real && field.size == 32) {
    bits = std::bit_cast<std::uint64_t>(
        static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits))));
  }
  value.number = static_cast<std::int64_t>(bits);
  values_.push_back(value);
}

void ShownFields::text(const ShownField& field, const std::uint8_t* begin, std::size_t length) {
  if (!has_room()) return;
  FieldValue value{.kind = field.kind, .name = field.name};
  if (length > 0 && field.kind == FieldValue::Kind::text) {
    auto* copy = static_cast<char*>(memory_.allocate(length, 1));
    std::memcpy(copy, begin, length);
    value.text = {copy, length};
  }
  values_.push_back(value);
}

void ShownFields::packed(const ShownField& field, const std::uint8_t* begin, std::size_t length) {
  const auto* nul = length > 0 ? std::memchr(begin, 0, length) : nullptr;
  if (nul != nullptr)
    length = static_cast<std::size_t>(static_cast<const std::uint8_t*>(nul) - begin);
  text(field, begin, length);
}

}  // namespace cie::analysis::ctf
