#include "program_writer.hpp"

#include "ctf/metadata/tokens.hpp"

#include <algorithm>

namespace cie::analysis::ctf {
namespace {

constexpr std::size_t kMaxFields = 500'000;

}  // namespace

Position common(Position a, Position b) {
  Position both{.align = std::min(a.align, b.align), .phase = 0};
  while (((a.phase ^ b.phase) & (both.align - 1)) != 0)
    both.align /= 2;
  both.phase = a.phase & (both.align - 1);
  return both;
}

void ProgramWriter::count(std::size_t fields) {
  context_.fields += fields;
  if (context_.fields > kMaxFields) {
    throw MetadataError("the types have more fields than any honest tracer writes");
  }
}

Op& ProgramWriter::emit(Op op) {
  count(1);
  is_block_open_ = false;
  sequence_->ops.push_back(std::move(op));
  return sequence_->ops.back();
}

Op& ProgramWriter::block() {
  if (!is_block_open_ || sequence_->ops.back().size > kMaxBlock) {
    emit({.code = Op::Code::block});
    is_block_open_ = true;
  }
  return sequence_->ops.back();
}

void ProgramWriter::align(std::uint64_t bits) {
  if (bits <= 1) return;
  if (bits > place_.align) {
    emit({.code = Op::Code::align, .size = bits});
    place_ = {.align = bits, .phase = 0};
    return;
  }
  const auto padding = (0 - place_.phase) & (bits - 1);
  if (padding == 0) return;
  if (is_block_open_ && padding % 8 == 0) {
    sequence_->ops.back().size += padding / 8;
  } else {
    emit({.code = Op::Code::align, .size = bits});
  }
  advance(padding);
}

}  // namespace cie::analysis::ctf
