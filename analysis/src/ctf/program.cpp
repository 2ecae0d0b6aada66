#include "program.hpp"

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
  if (is_signed && size < 64 && (value >> (size - 1) & 1) != 0) value |= ~std::uint64_t{0} << size;
  return value;
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

Outcome run_integer(const Op& op, Bits& bits, Frame& frame) noexcept {
  if (bits.end < bits.at || bits.end - bits.at < op.size) return Outcome::cut;
  if (op.slot >= 0 || op.reg >= 0) {
    const auto value = load_bits(bits.data, bits.at, static_cast<unsigned>(op.size),
                                 op.is_big_endian, op.is_signed);
    if (op.reg >= 0) frame.registers[static_cast<std::size_t>(op.reg)] = value;
    if (op.slot >= 0) store(frame.fields[op.slot], value, op.size, op.labels);
  }
  bits.at += op.size;
  return Outcome::ok;
}

Outcome run_text(const Op& op, Bits& bits, Frame& frame) noexcept {
  if (bits.end <= bits.at) return Outcome::cut;
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
  for (std::uint64_t i = 0; i < kept; ++i) {
    elements.push_back(static_cast<std::uint32_t>(load_bits(bits.data, bits.at + i * op.stride,
                                                            static_cast<unsigned>(op.size),
                                                            op.is_big_endian, op.is_signed)));
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
  if (op.slot >= 0) store_packed(op, count, bits, frame);
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
  const auto tag = frame.registers[static_cast<std::size_t>(op.length)] ^ op.bias;
  for (const auto& choice : op.choices) {
    if (tag >= choice.low && tag <= choice.high) return run(*choice.body, bits, frame);
  }
  return Outcome::no_option;
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
    }
    if (outcome != Outcome::ok) return outcome;
  }
  return Outcome::ok;
}

}  // namespace cie::analysis::ctf
