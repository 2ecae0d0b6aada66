#include "cdr_texts.hpp"

#include <algorithm>
#include <cstring>

#include <dds/ddsc/dds_opcodes.h>

namespace cie::executor {
namespace {

using Operation = std::uint32_t;

bool is_text(dds_stream_typecode type) noexcept {
  return type == DDS_OP_VAL_STR || type == DDS_OP_VAL_BST;
}

// How many words an instruction has for what is of this type.
std::size_t words_of(dds_stream_typecode type) noexcept {
  if (type == DDS_OP_VAL_BMK) return 2;
  return type == DDS_OP_VAL_BST || type == DDS_OP_VAL_ENU ? 1 : 0;
}

std::uint32_t size_of(Operation operation, dds_stream_typecode type) noexcept {
  switch (type) {
    case DDS_OP_VAL_2BY:
      return 2;
    case DDS_OP_VAL_4BY:
      return 4;
    case DDS_OP_VAL_8BY:
      return 8;
    case DDS_OP_VAL_ENU:
    case DDS_OP_VAL_BMK:
      return DDS_OP_TYPE_SZ(operation);
    default:
      return 1;
  }
}

// One member of a struct, as `dds_opcodes.h` writes it: a value, or several of them.
struct Member {
  explicit Member(const Operation* at) noexcept : type(DDS_OP_TYPE(*at)) {
    const bool is_bounded = type == DDS_OP_VAL_BSQ;
    is_sequence = type == DDS_OP_VAL_SEQ || is_bounded;
    std::size_t place = 2;  // of what belongs to the type of the values
    if (type == DDS_OP_VAL_ARR) {
      count = at[place++];
      type = DDS_OP_SUBTYPE(*at);
      if (type == DDS_OP_VAL_BST) ++place;
    } else if (is_sequence) {
      type = DDS_OP_SUBTYPE(*at);
      place += is_bounded ? 1 : 0;
    }
    size = size_of(*at, type);
    const bool is_nested = type == DDS_OP_VAL_EXT || type == DDS_OP_VAL_STU ||
                           type == DDS_OP_VAL_SEQ || type == DDS_OP_VAL_BSQ ||
                           type == DDS_OP_VAL_ARR;
    if (!is_nested) {
      next = at + place + words_of(type);
      return;
    }
    if (is_sequence) ++place;  // the size in memory stands before; of an array's it stands behind
    const Operation jump = at[place];
    nested = at + DDS_OP_ADR_JSR(jump);
    next =
        at + (DDS_OP_ADR_JMP(jump) != 0 ? DDS_OP_ADR_JMP(jump)
                                        : place + (type == DDS_OP_VAL_EXT || is_sequence ? 1 : 2));
  }

  dds_stream_typecode type;  // of the values
  bool is_sequence = false;
  std::uint32_t count = 1;  // unless it is a sequence
  std::uint32_t size = 0;   // of a value that is neither text nor nested
  const Operation* nested = nullptr;
  const Operation* next = nullptr;
};

bool is_end(Operation operation) noexcept { return DDS_OP(operation) == DDS_OP_RTS; }

using Programs = std::vector<const Operation*>;

// `entered`: what is being looked at already, in a type that contains itself.
bool has_texts(const Operation* at, Programs& entered);

bool has_texts(const Member& member, Programs& entered) {
  return is_text(member.type) || (member.nested != nullptr && has_texts(member.nested, entered));
}

bool has_texts(const Operation* at, Programs& entered) {
  if (std::ranges::find(entered, at) != entered.end()) return false;
  entered.push_back(at);
  while (!is_end(*at)) {
    if (DDS_OP(*at) == DDS_OP_JSR) {
      if (has_texts(at + DDS_OP_JUMP(*at), entered)) return true;
      ++at;
      continue;
    }
    const Member member{at};
    if (has_texts(member, entered)) return true;
    at = member.next;
  }
  return false;
}

// Goes through a message.
class Search {
 public:
  explicit Search(const unsigned char* message) noexcept : message_(message) {}

  bool finds_zero(const Operation* at, const Operation* end) noexcept {
    while (at != end && !is_end(*at)) {
      if (DDS_OP(*at) == DDS_OP_JSR) {
        if (finds_zero(at + DDS_OP_JUMP(*at), nullptr)) return true;
        ++at;
        continue;
      }
      const Member member{at};
      if (finds_zero(member)) return true;
      at = member.next;
    }
    return false;
  }

 private:
  bool finds_zero(const Member& member) noexcept {
    const std::uint32_t count = member.is_sequence ? number() : member.count;
    if (is_text(member.type)) {
      for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t length = number();  // with the last zero
        const auto* const text = message_ + position_;
        position_ += length;
        if (std::memchr(text, 0, length - 1) != nullptr) return true;
      }
    } else if (member.nested != nullptr) {
      for (std::uint32_t i = 0; i < count; ++i)
        if (finds_zero(member.nested, nullptr)) return true;
    } else if (count > 0) {
      align(member.size);
      position_ += std::size_t{member.size} * count;
    }
    return false;
  }
  std::uint32_t number() noexcept {
    std::uint32_t number = 0;
    align(sizeof number);
    std::memcpy(&number, message_ + position_, sizeof number);
    position_ += sizeof number;
    return number;
  }
  void align(std::size_t size) noexcept { position_ = (position_ + size - 1) / size * size; }

  const unsigned char* message_;
  std::size_t position_ = 0;
};

}  // namespace

CdrTexts::CdrTexts(const std::vector<std::uint32_t>& operations)
    : begin_(operations.data()), end_(begin_) {
  for (const Operation* at = begin_; !is_end(*at);) {
    Programs entered;
    const bool is_jump = DDS_OP(*at) == DDS_OP_JSR;
    const Operation* const next = is_jump ? at + 1 : Member{at}.next;
    if (is_jump ? has_texts(at + DDS_OP_JUMP(*at), entered) : has_texts(Member{at}, entered))
      end_ = next;
    at = next;
  }
}

bool CdrTexts::have_inner_zero(const unsigned char* message) const noexcept {
  return are_possible() && Search{message}.finds_zero(begin_, end_);
}

}  // namespace cie::executor
