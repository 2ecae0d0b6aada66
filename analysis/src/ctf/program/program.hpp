// A scope of a packet or event (its header, context or fields) as instructions for reading it: the
// flat form of a type. What is fixed in place is one block with one bounds check.
#pragma once

#include "vocabulary/field.hpp"
#include "vocabulary/label_table.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cie::analysis::ctf {

// Part of a packet that lies in memory. Positions are in bits from `data`, which stands at a place
// of the packet that no alignment crosses.
struct Bits {
  const std::uint8_t* data = nullptr;
  std::uint64_t at = 0;
  std::uint64_t end = 0;
};

// How an integer lies in memory.
enum class Load : std::uint8_t {
  u8,
  i8,
  u16,
  i16,
  u32,
  i32,
  u64,
  u16be,
  i16be,
  u32be,
  i32be,
  u64be,
  text  // characters up to a NUL or the array's end
};

constexpr std::int16_t kNone = -1;

// One value of a block that somebody wants.
struct Extract {
  std::uint32_t offset = 0;  // bytes from the block's begin
  Load load = Load::u8;
  std::uint8_t bits = 0;
  std::int16_t slot = kNone;
  std::int16_t reg = kNone;  // kept for a length or tag that refers to it
  const LabelTable* labels = nullptr;
  std::uint32_t length = 0;  // of a text
};

struct Sequence;
struct ShownField;
class ShownFields;

// Option of a variant, for tags from low to high (biased like LabelTable's).
struct Choice {
  std::uint64_t low = 0;
  std::uint64_t high = 0;
  std::shared_ptr<const Sequence> body;
};

// A register, and the value that nothing honest has, for where nobody fills it.
struct Forgotten {
  std::int16_t reg = kNone;
  std::uint64_t value = 0;
};

struct Op {
  enum class Code : std::uint8_t {
    block,    // `size` bytes, of which `extracts` are wanted
    align,    // to a multiple of `size` bits
    integer,  // of `size` bits, anywhere
    leb128,   // `count` integers of variable length, or as many as `length` says
    text,     // up to its NUL, of characters of `size` bits
    packed,   // integers of `size` bits: `count` of them, or as many as `length` says
    loop,     // `body` that often
    variant,  // one of `choices`, by `length`
    open,     // of a structure or list that is shown
    close
  };
  Code code = Code::block;
  bool is_signed = false;
  bool is_big_endian = false;
  bool is_text = false;      // packed: characters
  bool is_boolean = false;   // integer, packed: 1 if any bit is set
  bool is_reversed = false;  // integer, packed: the first bit is the last one
  bool is_list = false;      // leb128: elements rather than a number
  bool is_optional = false;  // variant: its tag may select nothing
  std::int16_t slot = kNone;
  std::int16_t reg = kNone;     // integer, leb128: where it is kept
  std::int16_t length = kNone;  // register with a length or tag
  std::uint64_t size = 0;       // leb128: bits it passes for; 0: seven for each of its bytes
  std::uint64_t stride = 0;     // packed: from one to the next, in bits
  std::uint64_t count = 0;
  std::uint64_t bias = 0;  // variant: see Choice
  const LabelTable* labels = nullptr;
  std::vector<Extract> extracts{};  // integer, leb128: more slots and registers for its value
  std::vector<Choice> choices{};
  std::vector<Forgotten> forgets{};  // variant: registers that only some options fill
  std::shared_ptr<const Sequence> body{};
  const ShownField* shown = nullptr;  // what to call its value; null: nobody wants to see it
};

struct Sequence {
  std::vector<Op> ops;
};

// Byte order of the integer that ends within a byte: whatever shares that byte must have it, too.
enum class BitOrder : std::uint8_t { unknown, little, big };

enum class Outcome : std::uint8_t {
  ok,
  cut,          // the data end before the scope does
  no_option,    // a variant's tag selects nothing
  too_large,    // a number has more than 64 bits
  mixed_order,  // the byte order changes within a byte, which CTF forbids: nobody knows whose bits
                // are whose
  too_complex   // more steps than any honest event needs
};

constexpr std::size_t kRegisters = 160;
using Registers = std::array<std::uint64_t, kRegisters>;

// What running a sequence reads and writes. One per stream.
struct Frame {
  Field* fields = nullptr;                         // slots of the scope
  std::vector<std::uint32_t>* elements = nullptr;  // backs Field::elements
  Registers registers{};
  std::uint64_t steps = 0;             // left to do
  ShownFields* shown = nullptr;        // where programs show values; null: nowhere
  BitOrder order = BitOrder::unknown;  // of the integer read last that may end within a byte
};

// Reads one scope from bits.at on. On any other outcome than ok bits.at is where it stopped.
Outcome run(const Sequence& sequence, Bits& bits, Frame& frame) noexcept;

}  // namespace cie::analysis::ctf
