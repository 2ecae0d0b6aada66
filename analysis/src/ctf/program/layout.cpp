#include "layout.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis::ctf {
namespace {

constexpr std::uint64_t kMaxLayout = 64U << 10U;  // bytes
constexpr std::int16_t kIdSlot = 0;
constexpr std::int16_t kTimeSlot = 1;

bool is_big_endian(Load load) {
  return load == Load::u16be || load == Load::i16be || load == Load::u32be || load == Load::i32be ||
         load == Load::u64be;
}

bool is_signed(Load load) { return load == Load::i8 || load == Load::i16 || load == Load::i32; }

std::optional<FixedField> value_at(std::uint64_t bit, std::uint64_t bits, bool is_signed_value,
                                   std::int16_t slot, const LabelTable* labels) {
  if (bit % 8 + bits > 64) return std::nullopt;
  if (bits == 0) return std::nullopt;
  const bool is_whole = bit % 8 == 0 && (bits == 8 || bits == 16 || bits == 32 || bits == 64);
  return FixedField{.kind = FixedField::Kind::integer,
                    .slot = static_cast<std::int8_t>(slot),
                    .shift = static_cast<std::uint8_t>(bit % 8),
                    .bytes = static_cast<std::uint8_t>(is_whole ? bits / 8 : 0),
                    .offset = static_cast<std::uint32_t>(bit / 8),
                    .is_int32 = is_whole && bits == 32 && is_signed_value,
                    .mask = ~std::uint64_t{0} >> (64 - bits),
                    .sign = is_signed_value ? std::uint64_t{1} << (bits - 1) : 0,
                    .labels = labels};
}

// Follows a sequence that begins on a byte, bit by bit of the way.
class Walker {
 public:
  struct Kept {
    std::int16_t reg = kNone;
    FixedField value;
  };

  // False: there is something without a fixed place. `from`, `to`: operations.
  bool walk(const std::vector<Op>& ops, std::size_t from, std::size_t to) {
    return std::all_of(ops.begin() + static_cast<std::ptrdiff_t>(from),
                       ops.begin() + static_cast<std::ptrdiff_t>(to),
                       [this](const Op& op) { return walk(op) && bits_ / 8 <= kMaxLayout; });
  }

  std::uint64_t bits() const { return bits_; }
  const std::vector<Kept>& kept() const { return kept_; }
  std::vector<FixedField>& fields() { return fields_; }

 private:
  bool walk(const Op& op) {
    if (op.shown != nullptr) return false;
    switch (op.code) {
      case Op::Code::align:
        bits_ = (bits_ + op.size - 1) & ~(op.size - 1);
        return op.size <= 8;
      case Op::Code::block: {
        const bool is_fixed = std::all_of(op.extracts.begin(), op.extracts.end(),
                                          [this](const Extract& extract) { return add(extract); });
        bits_ += op.size * 8;
        return is_fixed;
      }
      case Op::Code::integer: {
        if (changes_order(op)) return false;
        const bool is_wanted = op.slot >= 0 || op.reg >= 0;
        const bool is_simple =
            !op.is_big_endian && !op.is_boolean && !op.is_reversed && op.extracts.empty();
        const bool is_fixed = !is_wanted || (is_simple && add(bits_, op.size, op.is_signed, op.slot,
                                                              op.reg, op.labels));
        bits_ += op.size;
        return is_fixed;
      }
      case Op::Code::packed: {
        std::uint64_t size = 0;
        if (op.length >= 0 || op.slot >= 0 || op.stride != op.size ||
            __builtin_mul_overflow(op.count, op.size, &size) || size / 8 > kMaxLayout) {
          return false;
        }
        if (op.count > 0 && changes_order(op)) return false;
        bits_ += size;
        return true;
      }
      default:
        return false;
    }
  }

  // What shares a byte with the other byte order is for the program to refuse.
  bool changes_order(const Op& op) {
    const auto order = op.is_big_endian ? BitOrder::big : BitOrder::little;
    return std::exchange(order_, order) != order && bits_ % 8 != 0;
  }

  bool add(const Extract& extract) {
    const auto bit = bits_ + std::uint64_t{extract.offset} * 8;
    if (extract.load == Load::text) {
      fields_.push_back({.kind = FixedField::Kind::text,
                         .slot = static_cast<std::int8_t>(extract.slot),
                         .offset = static_cast<std::uint32_t>(bit / 8),
                         .length = extract.length});
      return true;
    }
    return !is_big_endian(extract.load) && add(bit, extract.bits, is_signed(extract.load),
                                               extract.slot, extract.reg, extract.labels);
  }

  bool add(std::uint64_t bit, std::uint64_t size, bool is_signed_value, std::int16_t slot,
           std::int16_t reg, const LabelTable* labels) {
    const auto value = value_at(bit, size, is_signed_value, slot, labels);
    if (!value) return false;
    if (reg >= 0) kept_.push_back({.reg = reg, .value = *value});
    if (slot >= 0) fields_.push_back(*value);
    return true;
  }

  std::uint64_t bits_ = 0;
  BitOrder order_ = BitOrder::unknown;
  std::vector<Kept> kept_;
  std::vector<FixedField> fields_;
};

// The header's way with one option of its variant at the end (or none).
std::optional<HeaderLayout::Option> option_of(const std::vector<Op>& ops, std::size_t fixed,
                                              const Sequence* body) {
  Walker walker;
  if (!walker.walk(ops, 0, fixed)) return std::nullopt;
  const auto kept = walker.kept().size();
  if (body != nullptr && !walker.walk(body->ops, 0, body->ops.size())) return std::nullopt;
  if (walker.bits() % 8 != 0 || walker.kept().size() != kept) return std::nullopt;
  HeaderLayout::Option option;
  option.bytes = walker.bits() / 8;
  bool has_id = false;
  bool has_time = false;
  for (const auto& value : walker.fields()) {
    if (value.slot == kIdSlot) {
      option.id = value;
      has_id = true;
    } else if (value.slot == kTimeSlot) {
      option.time = value;
      has_time = true;
    }
  }
  if (!has_id || !has_time || option.id.sign != 0) return std::nullopt;
  return option;
}

bool is_integer_at(const FixedField& field, std::uint64_t bit, std::uint64_t mask) {
  return field.offset == bit / 8 && field.shift == bit % 8 && field.mask == mask && field.sign == 0;
}

template <unsigned kTagBits, unsigned kTimeBits>
bool is_of(LttngHeader<kTagBits, kTimeBits> header, const HeaderLayout& layout) {
  if (layout.options.size() != 2 || !is_integer_at(layout.tag, 0, header.kTagMask)) return false;
  const auto& brief = layout.options[0];
  const auto& whole = layout.options[1];
  return brief.low == 0 && brief.high == header.kTagMask - 1 && whole.low == header.kTagMask &&
         whole.high == header.kTagMask && is_integer_at(brief.id, 0, header.kTagMask) &&
         is_integer_at(brief.time, kTagBits, header.kTimeMask) &&
         brief.bytes == header.kShortBytes &&
         is_integer_at(whole.id, header.kIdOffset * 8, ~std::uint32_t{0}) &&
         is_integer_at(whole.time, header.kTimeOffset * 8, ~std::uint64_t{0}) &&
         whole.bytes == header.kLongBytes;
}

}  // namespace

std::optional<Layout> layout_of(const Sequence* program) {
  if (program == nullptr) return Layout{};
  Walker walker;
  if (!walker.walk(program->ops, 0, program->ops.size())) return std::nullopt;
  if (walker.bits() % 8 != 0 || !walker.kept().empty()) return std::nullopt;
  return Layout{.bytes = walker.bits() / 8, .fields = std::move(walker.fields())};
}

std::optional<HeaderLayout> header_layout_of(const Sequence* program) {
  if (program == nullptr || program->ops.empty()) return std::nullopt;
  const auto& ops = program->ops;
  HeaderLayout layout;
  const bool has_variant = ops.back().code == Op::Code::variant;
  const auto fixed = ops.size() - (has_variant ? 1 : 0);
  Walker walker;
  if (!walker.walk(ops, 0, fixed)) return std::nullopt;
  if (!has_variant) {
    auto option = option_of(ops, fixed, nullptr);
    if (!option || !walker.kept().empty()) return std::nullopt;
    layout.options.push_back(*option);
  } else {
    const auto& variant = ops.back();
    if (walker.kept().size() != 1 || walker.kept().front().reg != variant.length ||
        walker.kept().front().value.sign != 0 || variant.bias != 0) {
      return std::nullopt;
    }
    layout.tag = walker.kept().front().value;
    layout.tag_register = variant.length;
    for (const auto& choice : variant.choices) {
      auto option = option_of(ops, fixed, choice.body.get());
      if (!option) return std::nullopt;
      option->low = choice.low;
      option->high = choice.high;
      layout.options.push_back(*option);
    }
  }
  for (const auto& option : layout.options)
    layout.most_bytes = std::max(layout.most_bytes, option.bytes);
  if (is_of(CompactHeader{}, layout)) layout.shape = HeaderLayout::Shape::compact;
  if (is_of(LargeHeader{}, layout)) layout.shape = HeaderLayout::Shape::large;
  return layout;
}

}  // namespace cie::analysis::ctf
