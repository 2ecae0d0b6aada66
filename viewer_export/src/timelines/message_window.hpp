// The messages published of late: whoever takes one mostly does so soon.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace cie::viewer_export {

// One message; no writer has the gid 0.
struct MessageKey {
  std::uint64_t writer_gid = 0;
  std::int64_t source_timestamp = 0;
  friend bool operator==(const MessageKey&, const MessageKey&) = default;
};

inline std::uint64_t hash_of(const MessageKey& key) noexcept {
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15;  // 2^64 / golden ratio: Knuth 6.4
  const auto mixed = (key.writer_gid * kGolden) ^ static_cast<std::uint64_t>(key.source_timestamp);
  return mixed * kGolden;
}

// Remembers a fixed number of messages; new ones push out the oldest, and now and then another one.
// Not thread-safe.
template <typename Message>
class MessageWindow {
 public:
  // A message that is there already stays as it is.
  void add(const MessageKey& key, const Message& message) {
    const auto hash = hash_of(key);
    auto& bucket = buckets_[bucket_of(hash)];
    if (find(bucket, hash, key) != nullptr) return;
    for (std::size_t i = kPlaces - 1; i > 0; --i)
      bucket[i] = bucket[i - 1];
    bucket[0] = {.hash = short_of(hash), .place = next_};
    messages_[next_++] = {key, message};
  }
  // Null if it is not there, or no longer. Valid until the next add().
  Message* find(const MessageKey& key) {
    const auto hash = hash_of(key);
    return find(buckets_[bucket_of(hash)], hash, key);
  }

 private:
  using Place = std::uint16_t;  // in messages_; after the last one comes the first
  struct Entry {
    std::uint16_t hash = 0;
    Place place = 0;
  };
  struct Kept {
    MessageKey key;
    Message message{};
  };
  static constexpr unsigned kBucketBits = 14;
  static constexpr std::size_t kPlaces = 4;
  using Bucket = std::array<Entry, kPlaces>;  // newest first

  static std::size_t bucket_of(std::uint64_t hash) { return hash >> (64U - kBucketBits); }
  static std::uint16_t short_of(std::uint64_t hash) {
    return static_cast<std::uint16_t>(hash >> 16U);
  }
  // Looks at messages only whose short hash is right: old ones are far away in memory.
  Message* find(const Bucket& bucket, std::uint64_t hash, const MessageKey& key) {
    for (const auto& entry : bucket) {
      auto& kept = messages_[entry.place];
      if (entry.hash == short_of(hash) && kept.key == key) return &kept.message;
    }
    return nullptr;
  }

  std::vector<Bucket> buckets_ = std::vector<Bucket>(std::size_t{1} << kBucketBits);
  std::vector<Kept> messages_ =
      std::vector<Kept>(std::size_t{std::numeric_limits<Place>::max()} + 1);
  Place next_ = 0;
};

}  // namespace cie::viewer_export
