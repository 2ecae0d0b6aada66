// One packet of a stream as its header and context describe it.
#pragma once

#include "ctf/program/trace_plan.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace cie::analysis::ctf {

// A counter of the tracer, which wraps at its width.
struct Counter {
  std::uint64_t value = 0;
  std::uint32_t bits = 64;

  // How far it went since `earlier`.
  std::uint64_t since(std::uint64_t earlier) const noexcept {
    const auto difference = value - earlier;
    return bits >= 64 ? difference : difference & ((std::uint64_t{1} << bits) - 1);
  }
  // A step of half its range or more is one backwards.
  bool is_behind(std::uint64_t earlier) const noexcept {
    return since(earlier) >> (bits >= 64 ? 63U : bits - 1) != 0;
  }
};

struct Packet {
  const StreamPlan* stream = nullptr;
  std::uint64_t offset = 0;        // bytes in the file
  std::uint64_t size = 0;          // bytes
  bool has_size = true;            // as it tells; otherwise it is the rest of its file
  std::uint64_t events_begin = 0;  // bits in the packet
  std::uint64_t content_end = 0;   // bits in the packet
  std::optional<std::uint64_t> instance;
  std::optional<std::uint64_t> begin;  // cycles
  std::optional<std::uint64_t> end;
  std::optional<Counter> discarded;
  std::optional<Counter> sequence;
  std::optional<std::int32_t> cpu;
  BitOrder order = BitOrder::unknown;  // of the context, where it ends within a byte
  std::optional<Uuid> other_uuid;      // its header's, where that is not the metadata's
};

// Bytes that are no good packet.
struct Damage {
  std::uint64_t offset = 0;
  std::string reason;
};

}  // namespace cie::analysis::ctf
