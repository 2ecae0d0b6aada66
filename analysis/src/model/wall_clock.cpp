#include "wall_clock.hpp"

#include <algorithm>

namespace cie::analysis {

std::optional<std::int64_t> clock_offset_ns(const Model& model) {
  std::optional<std::int64_t> offset;
  for (const auto& stream : model.streams) {
    if (stream.clock_offset_ns == 0) return std::nullopt;
    if (!offset) offset = stream.clock_offset_ns;
    if (!detail::are_alike(stream.clock_offset_ns, *offset)) return std::nullopt;
  }
  return offset;
}

std::optional<std::int64_t> begin_realtime_ns(const Model& model) {
  std::optional<std::int64_t> earliest;
  for (const auto& stream : model.streams) {
    std::int64_t begin = 0;
    if (stream.clock_offset_ns == 0 || !stream.begin ||
        __builtin_add_overflow(stream.begin->ns, stream.clock_offset_ns, &begin)) {
      continue;
    }
    earliest = std::min(earliest.value_or(begin), begin);
  }
  return earliest;
}

}  // namespace cie::analysis
