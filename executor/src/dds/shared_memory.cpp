#include "shared_memory.hpp"

#include <algorithm>
#include <cstring>

namespace cie::executor {
namespace {

// How iceoryx begins a chunk (iceoryx_posh/mepoo/chunk_header.hpp). In other versions all behind the
// version may be otherwise.
struct ChunkHeader {
  std::uint32_t size;
  std::uint8_t version;
  std::uint8_t reserved;
  std::uint16_t user_header;
  std::uint64_t publisher;
  std::uint64_t number;
};
constexpr std::uint8_t kKnownVersion = 1;

}  // namespace

std::optional<ChunkNumber> number_of_chunk(const void* chunk) noexcept {
  // In front of the sample stands how far behind the header it is.
  const auto* const sample = static_cast<const unsigned char*>(chunk);
  std::uint32_t distance = 0;
  std::memcpy(&distance, sample - sizeof distance, sizeof distance);
  ChunkHeader header{};
  std::memcpy(&header, sample - distance, sizeof header);
  if (header.version != kKnownVersion) return std::nullopt;
  return ChunkNumber{.publisher = header.publisher, .number = header.number};
}

std::uint64_t ChunkGaps::before(const ChunkNumber& chunk) {
  const auto known =
      std::ranges::find(next_, chunk.publisher, &std::pair<std::uint64_t, std::uint64_t>::first);
  if (known == next_.end()) {
    next_.emplace_back(chunk.publisher, chunk.number + 1);
    return 0;
  }
  if (chunk.number < known->second) return 0;  // of its history, once more
  const auto missing = chunk.number - known->second;
  known->second = chunk.number + 1;
  return missing;
}

}  // namespace cie::executor
