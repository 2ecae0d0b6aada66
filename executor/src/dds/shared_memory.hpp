// What iceoryx tells of the chunks of shared memory that samples come in.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace cie::executor {

// A subscriber of iceoryx holds 256 chunks at most, and loses further ones: those of samples that
// wait, and some of samples that are being stored or taken.
inline constexpr std::uint32_t kMostChunksHeld = 256;
inline constexpr std::uint32_t kDeepestQueueInSharedMemory = kMostChunksHeld - 16;

// The chunk of a sample of Cyclone DDS; null unless it came in one. Cyclone DDS built without shared
// memory has no such member.
template <typename Sample>
const void* in_shared_memory(const Sample* sample) noexcept {
  if constexpr (requires { sample->iox_chunk; }) {
    return sample->iox_chunk;
  } else {
    return nullptr;
  }
}

// Its place among all chunks of its publisher: numbers are contiguous from 0.
struct ChunkNumber {
  std::uint64_t publisher = 0;
  std::uint64_t number = 0;
};

// `chunk`: where the sample begins in it. Empty if iceoryx is one whose chunks begin otherwise.
std::optional<ChunkNumber> number_of_chunk(const void* chunk) noexcept;

// Which chunks a subscriber never got. iceoryx keeps as many as the subscription is deep until its
// listener hands them over, drops the oldest ones for others, and says that by no count.
class ChunkGaps {
 public:
  // How many are missing between this one and the last one of its publisher before.
  std::uint64_t before(const ChunkNumber& chunk);

 private:
  std::vector<std::pair<std::uint64_t, std::uint64_t>>
      next_;  // by publisher, of which there are few
};

}  // namespace cie::executor
