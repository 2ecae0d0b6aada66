// The messages published of late: whoever takes one mostly does so soon.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cie::viewer_export {

// One message; a writer_gid of 0 is nobody's.
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

// Remembers a fixed number of messages; new ones push out old ones, more or less the oldest. Not
// thread-safe.
template <typename Message>
class MessageWindow {
 public:
  // A message that is there already stays as it is.
  void add(const MessageKey& key, const Message& message) {
    auto& bucket = bucket_of(key);
    if (find(bucket, key) != nullptr) return;
    for (std::size_t i = kPlaces - 1; i > 0; --i)
      bucket[i] = bucket[i - 1];
    bucket[0] = {key, message};
  }
  // Null if it is not there, or no longer. Valid until the next add().
  Message* find(const MessageKey& key) { return find(bucket_of(key), key); }

 private:
  static constexpr unsigned kBucketBits = 14;
  static constexpr std::size_t kPlaces = 4;
  struct Place {
    MessageKey key;
    Message message{};
  };
  using Bucket = std::array<Place, kPlaces>;  // newest first

  Bucket& bucket_of(const MessageKey& key) { return buckets_[hash_of(key) >> (64U - kBucketBits)]; }
  static Message* find(Bucket& bucket, const MessageKey& key) {
    for (auto& place : bucket)
      if (place.key == key) return &place.message;
    return nullptr;
  }

  std::vector<Bucket> buckets_ = std::vector<Bucket>(std::size_t{1} << kBucketBits);
};

}  // namespace cie::viewer_export
