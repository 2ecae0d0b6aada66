#include "program.hpp"

#include "shown_fields.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <utility>

namespace cie::analysis::ctf {
namespace {

static_assert(std::endian::native == std::endian::little, "loads assume a little-endian machine");

template <typename T>
T load_as(const std::uint8_t* at) noexcept {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

std::uint64_t load(Load how, const std::uint8_t* at) noexcept {
  const auto widen = [](auto value) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(value));
  };
  switch (how) {
    case Load::u8:
      return *at;
    case Load::i8:
      return widen(load_as<std::int8_t>(at));
    case Load::u16:
      return load_as<std::uint16_t>(at);
    case Load::i16:
      return widen(load_as<std::int16_t>(at));
    case Load::u32:
      return load_as<std::uint32_t>(at);
    case Load::i32:
      return widen(load_as<std::int32_t>(at));
    case Load::u64:
      return load_as<std::uint64_t>(at);
    case Load::u16be:
      return __builtin_bswap16(load_as<std::uint16_t>(at));
    case Load::i16be:
      return widen(static_cast<std::int16_t>(__builtin_bswap16(load_as<std::uint16_t>(at))));
    case Load::u32be:
      return __builtin_bswap32(load_as<std::uint32_t>(at));
    case Load::i32be:
      return widen(static_cast<std::int32_t>(__builtin_bswap32(load_as<std::uint32_t>(at))));
    case Load::u64be:
      return __builtin_bswap64(load_as<std::uint64_t>(at));
    case Load::text:
      break;
  }
  return 0;
}

// A number of fewer bits, of which the highest one is its sign.
std::uint64_t with_sign(std::uint64_t value, unsigned size) noexcept {
  const bool is_negative = size > 0 && size < 64 && (value >> (size - 1) & 1) != 0;
  return is_negative ? value | ~std::uint64_t{0} << size : value;
}

// Bits of little-endian integers count from the least significant one of each byte, of big-endian
// ones from the most significant one (CTF 1.8, 4.1.5).
std::uint64_t load_bits(const std::uint8_t* data, std::uint64_t at, unsigned size,
                        bool is_big_endian, bool is_signed) noexcept {
  std::uint64_t value = 0;
  for (unsigned done = 0; done < size;) {
    const auto skip = static_cast<unsigned>(at % 8);
    const auto take = std::min(8 - skip, size - done);
    const unsigned byte = data[at / 8];
    const unsigned mask = (1U << take) - 1;
    if (is_big_endian) {
      value = value << take | (byte >> (8 - skip - take) & mask);
    } else {
      value |= static_cast<std::uint64_t>(byte >> skip & mask) << done;
    }
    done += take;
    at += take;
  }
  return is_signed ? with_sign(value, size) : value;
}

std::uint64_t reversed(std::uint64_t value, unsigned size) noexcept {
  std::uint64_t result = 0;
  for (unsigned bit = 0; bit < size; ++bit)
    result |= (value >> bit & 1) << (size - 1 - bit);
  return result;
}

std::uint64_t load_number(const Op& op, const std::uint8_t* data, std::uint64_t at) noexcept {
  const auto size = static_cast<unsigned>(op.size);
  if (!op.is_reversed && !op.is_boolean) {
    return load_bits(data, at, size, op.is_big_endian, op.is_signed);
  }
  auto value = load_bits(data, at, size, op.is_big_endian, false);
  if (op.is_boolean) return value != 0 ? 1 : 0;
  value = reversed(value, size);
  return op.is_signed ? with_sign(value, size) : value;
}

void store(Field& field, std::uint64_t value, std::uint64_t bits,
           const LabelTable* labels) noexcept {
  field.kind = Field::Kind::integer;
  field.length = static_cast<std::uint32_t>(bits);
  field.number = static_cast<std::int64_t>(value);
  if (labels != nullptr) field.label = labels->find(value);
}

// Characters of an array: up to the first NUL.
void store_text(Field& field, const std::uint8_t* begin, std::uint64_t length) noexcept {
  const auto* nul = static_cast<const std::uint8_t*>(std::memchr(begin, 0, length));
  field.kind = Field::Kind::text;
  field.characters = reinterpret_cast<const char*>(begin);
  field.length =
      static_cast<std::uint32_t>(nul != nullptr ? static_cast<std::uint64_t>(nul - begin) : length);
}

Outcome run_block(const Op& op, Bits& bits, Frame& frame) noexcept {
  assert(bits.at % 8 == 0 && "blocks are built where positions are whole bytes");
  if (bits.end < bits.at || bits.end - bits.at < op.size * 8) return Outcome::cut;
  const auto* begin = bits.data + bits.at / 8;
  for (const auto& extract : op.extracts) {
    if (extract.load == Load::text) {
      store_text(frame.fields[extract.slot], begin + extract.offset, extract.length);
      continue;
    }
    const auto value = load(extract.load, begin + extract.offset);
    if (extract.reg >= 0) frame.registers[static_cast<std::size_t>(extract.reg)] = value;
    if (extract.slot >= 0) store(frame.fields[extract.slot], value, extract.bits, extract.labels);
  }
  bits.at += op.size * 8;
  return Outcome::ok;
}

void keep(const Op& op, std::uint64_t value, std::uint64_t size, Frame& frame) noexcept {
  if (op.reg >= 0) frame.registers[static_cast<std::size_t>(op.reg)] = value;
  if (op.slot >= 0) store(frame.fields[op.slot], value, size, op.labels);
  if (op.shown != nullptr && frame.shown != nullptr) frame.shown->number(*op.shown, value);
  for (const auto& more : op.extracts) {
    if (more.reg >= 0) frame.registers[static_cast<std::size_t>(more.reg)] = value;
    if (more.slot >= 0) store(frame.fields[more.slot], value, size, more.labels);
  }
}

// Whether an integer shares a byte with one of the other byte order. Notes its own.
bool changes_order(const Op& op, const Bits& bits, Frame& frame) noexcept {
  const auto order = op.is_big_endian ? BitOrder::big : BitOrder::little;
  const auto before = std::exchange(frame.order, order);
  return bits.at % 8 != 0 && before != order && before != BitOrder::unknown;
}

Outcome run_integer(const Op& op, Bits& bits, Frame& frame) noexcept {
  if (bits.end < bits.at || bits.end - bits.at < op.size) return Outcome::cut;
  if (changes_order(op, bits, frame)) return Outcome::mixed_order;
  if (op.slot >= 0 || op.reg >= 0 || op.shown != nullptr) {
    keep(op, load_number(op, bits.data, bits.at), op.size, frame);
  }
  bits.at += op.size;
  return Outcome::ok;
}

// Seven bits a byte, the lowest ones first; the last byte has no bit 7.
Outcome load_leb128(Bits& bits, bool is_signed, std::uint64_t& value, unsigned& bytes) noexcept {
  constexpr unsigned kMaxBytes = 10;  // 70 bits, of which the last six say nothing new
  value = 0;
  for (bytes = 0; bytes < kMaxBytes;) {
    if (bits.end < bits.at || bits.end - bits.at < 8) return Outcome::cut;
    const std::uint64_t byte = bits.data[bits.at / 8];
    const auto payload = byte & 0x7f;
    const auto shift = 7 * bytes++;
    bits.at += 8;
    value |= payload << shift;
    if (shift > 56) {
      // A sign may go on, and bit 63 be there; everything else does not fit.
      const bool fits = is_signed ? payload == 0 || payload == 0x7f : payload <= 1;
      return fits && byte < 0x80 ? Outcome::ok : Outcome::too_large;
    }
    if (byte < 0x80) {
      if (is_signed && (payload & 0x40) != 0) value |= ~std::uint64_t{0} << (shift + 7);
      return Outcome::ok;
    }
  }
  return Outcome::too_large;
}

Outcome run_leb128(const Op& op, std::uint64_t count, Bits& bits, Frame& frame) noexcept {
  auto* elements = op.is_list && op.slot >= 0 ? frame.elements : nullptr;
  if (elements != nullptr) elements->clear();
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint64_t value = 0;
    unsigned bytes = 0;
    const auto outcome = load_leb128(bits, op.is_signed, value, bytes);
    if (outcome != Outcome::ok) return outcome;
    if (!op.is_list) {
      keep(op, value, op.size != 0 ? op.size : std::uint64_t{7} * bytes, frame);
    } else if (elements != nullptr && elements->size() < kMaxElements) {
      elements->push_back(static_cast<std::uint32_t>(value));
    }
  }
  if (elements != nullptr) {
    auto& field = frame.fields[op.slot];
    field.kind = Field::Kind::integers;
    field.elements = elements->data();
    field.length = static_cast<std::uint32_t>(elements->size());
  }
  return Outcome::ok;
}

// Characters of two or four bytes up to one that is 0.
Outcome skip_wide_text(const Op& op, Bits& bits) noexcept {
  const auto width = op.size / 8;
  while (bits.end >= bits.at && bits.end - bits.at >= op.size) {
    const auto* begin = bits.data + bits.at / 8;
    bits.at += op.size;
    if (std::all_of(begin, begin + width, [](std::uint8_t byte) { return byte == 0; })) {
      return Outcome::ok;
    }
  }
  return Outcome::cut;
}

Outcome run_text(const Op& op, Bits& bits, Frame& frame) noexcept {
  if (bits.end <= bits.at) return Outcome::cut;
  if (op.size > 8) {
    const auto outcome = skip_wide_text(op, bits);
    const bool is_shown = op.shown != nullptr && frame.shown != nullptr;
    if (outcome == Outcome::ok && is_shown) frame.shown->text(*op.shown, nullptr, 0);
    return outcome;
  }
  const auto* begin = bits.data + bits.at / 8;
  const auto available = (bits.end - bits.at) / 8;
  const auto* nul = static_cast<const std::uint8_t*>(std::memchr(begin, 0, available));
  if (nul == nullptr) return Outcome::cut;
  if (op.slot >= 0) {
    auto& field = frame.fields[op.slot];
    field.kind = Field::Kind::text;
    field.characters = reinterpret_cast<const char*>(begin);
    field.length = static_cast<std::uint32_t>(nul - begin);
  }
  if (op.shown != nullptr && frame.shown != nullptr) {
    frame.shown->text(*op.shown, begin, static_cast<std::size_t>(nul - begin));
  }
  bits.at += static_cast<std::uint64_t>(nul - begin + 1) * 8;
  return Outcome::ok;
}

void store_packed(const Op& op, std::uint64_t count, const Bits& bits, Frame& frame) {
  auto& field = frame.fields[op.slot];
  if (op.is_text) {
    store_text(field, bits.data + bits.at / 8, count);
    return;
  }
  auto& elements = *frame.elements;
  elements.clear();
  const auto kept = std::min<std::uint64_t>(count, kMaxElements);
  // As in the uuid of every packet's header.
  const bool are_bytes = op.size == 8 && op.stride == 8 && bits.at % 8 == 0 && !op.is_signed &&
                         !op.is_reversed && !op.is_boolean;
  if (are_bytes) {
    const auto* bytes = bits.data + bits.at / 8;
    elements.assign(bytes, bytes + kept);
  }
  for (std::uint64_t i = elements.size(); i < kept; ++i) {
    elements.push_back(
        static_cast<std::uint32_t>(load_number(op, bits.data, bits.at + i * op.stride)));
  }
  field.kind = Field::Kind::integers;
  field.elements = elements.data();
  field.length = static_cast<std::uint32_t>(elements.size());
}

Outcome run_packed(const Op& op, std::uint64_t count, Bits& bits, Frame& frame) noexcept {
  std::uint64_t size = 0;
  if (count > 0 && (__builtin_mul_overflow(count - 1, op.stride, &size) ||
                    __builtin_add_overflow(size, op.size, &size))) {
    return Outcome::cut;
  }
  if (bits.end < bits.at || bits.end - bits.at < size) return Outcome::cut;
  if (count > 0 && changes_order(op, bits, frame)) return Outcome::mixed_order;
  if (op.slot >= 0) store_packed(op, count, bits, frame);
  if (op.shown != nullptr && frame.shown != nullptr) {
    frame.shown->packed(*op.shown, bits.data + bits.at / 8, op.is_text ? count : 0);
  }
  bits.at += size;
  return Outcome::ok;
}

Outcome run_loop(const Op& op, std::uint64_t count, Bits& bits, Frame& frame) noexcept {
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto outcome = run(*op.body, bits, frame);
    if (outcome != Outcome::ok) return outcome;
  }
  return Outcome::ok;
}

Outcome run_variant(const Op& op, Bits& bits, Frame& frame) noexcept {
  constexpr std::uint64_t kFreeChoices = 64;
  const auto tag = frame.registers[static_cast<std::size_t>(op.length)] ^ op.bias;
  for (const auto& [reg, value] : op.forgets)
    frame.registers[static_cast<std::size_t>(reg)] = value;
  frame.steps -= std::min<std::uint64_t>(frame.steps, op.choices.size() / kFreeChoices);
  for (const auto& choice : op.choices) {
    if (tag >= choice.low && tag <= choice.high) return run(*choice.body, bits, frame);
  }
  return op.is_optional ? Outcome::ok : Outcome::no_option;
}

}  // namespace

Outcome run(const Sequence& sequence, Bits& bits, Frame& frame) noexcept {
  for (const auto& op : sequence.ops) {
    if (frame.steps == 0) return Outcome::too_complex;
    --frame.steps;
    const auto count =
        op.length >= 0 ? frame.registers[static_cast<std::size_t>(op.length)] : op.count;
    auto outcome = Outcome::ok;
    switch (op.code) {
      case Op::Code::block:
        outcome = run_block(op, bits, frame);
        break;
      case Op::Code::align:
        bits.at = (bits.at + op.size - 1) & ~(op.size - 1);
        break;
      case Op::Code::integer:
        outcome = run_integer(op, bits, frame);
        break;
      case Op::Code::leb128:
        outcome = run_leb128(op, count, bits, frame);
        break;
      case Op::Code::text:
        outcome = run_text(op, bits, frame);
        break;
      case Op::Code::packed:
        outcome = run_packed(op, count, bits, frame);
        break;
      case Op::Code::loop:
        outcome = run_loop(op, count, bits, frame);
        break;
      case Op::Code::variant:
        outcome = run_variant(op, bits, frame);
        break;
      case Op::Code::open:
        if (frame.shown != nullptr) frame.shown->open(*op.shown);
        break;
      case Op::Code::close:
        if (frame.shown != nullptr) frame.shown->close();
        break;
    }
    if (outcome != Outcome::ok) return outcome;
  }
  return Outcome::ok;
}

}  // namespace cie::analysis::ctf
