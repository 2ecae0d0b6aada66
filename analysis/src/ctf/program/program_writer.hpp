// Appends operations to a program and follows what is known of the position meanwhile.
#pragma once

#include "program.hpp"
#include "scope.hpp"
#include "scope_names.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

namespace cie::analysis::ctf {

constexpr std::uint64_t kMaxBlock = 1U << 20U;  // bytes; one block more may be joined

// What is known of a position: a multiple of `align` bits plus `phase`.
struct Position {
  std::uint64_t align = 1;
  std::uint64_t phase = 0;
};

// What is known wherever one of two ways ended.
Position common(Position a, Position b);

class ProgramWriter {
 public:
  // Borrowed. Throws MetadataError when the trace's programs become too large.
  ProgramWriter(BuildContext& context, Sequence& program)
      : context_(context), sequence_(&program) {}

  Op& emit(Op op);
  // A block that the next field of whole bytes joins, growing it.
  Op& block();
  void align(std::uint64_t bits);

  bool is_whole_byte() const { return place_.align >= 8 && place_.phase % 8 == 0; }
  Position place() const { return place_; }
  void advance(std::uint64_t bits) { place_.phase = (place_.phase + bits) & (place_.align - 1); }
  void stand_at(Position place) { place_ = place; }

  // The operation emitted last is where the value of `names` is read, or its option chosen.
  void note(ScopeNames& names) const {
    names.sequence = sequence_;
    names.op = sequence_->ops.size() - 1;
  }
  // What `write` emits becomes a sequence of its own, which begins at `from`. Afterwards the
  // position is the one at its end.
  template <typename Write>
  std::shared_ptr<const Sequence> body(Position from, Write&& write) {
    const auto body = std::make_shared<Sequence>();
    context_.bodies.push_back(body);
    const auto outer = std::exchange(sequence_, body.get());
    place_ = from;
    is_block_open_ = false;
    write();
    sequence_ = outer;
    is_block_open_ = false;
    return body;
  }
  // Shared types multiply when they are laid out flat.
  void count(std::size_t fields);

 private:
  BuildContext& context_;
  Sequence* sequence_;
  Position place_;
  bool is_block_open_ = false;
};

}  // namespace cie::analysis::ctf
