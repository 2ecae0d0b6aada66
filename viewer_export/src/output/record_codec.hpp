// Records that resemble the ones before them, as few bytes: what is spilled to disk costs what is
// written and read again.
#pragma once

#include "binary_numbers.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace cie::viewer_export {

// A record as words of 64 bits: which of them differ from those of the record before, and by how
// much (varint, zigzag). One object for each sequence and direction.
template <typename Record>
class RecordCodec {
  static_assert(std::is_trivially_copyable_v<Record>);
  static constexpr std::size_t kWords = (sizeof(Record) + 7) / 8;
  static constexpr std::size_t kMaskBytes = (kWords + 7) / 8;

 public:
  // An encoded record is never longer.
  static constexpr std::size_t kMostBytes = kMaskBytes + kWords * kLongestVarint;

  // Writes the record to `out`, which has room for kMostBytes. Returns what follows.
  char* encode(const Record& record, char* out) noexcept {
    std::array<std::uint64_t, kWords> words{};
    std::memcpy(words.data(), &record, sizeof record);
    auto* const mask = out;
    std::memset(mask, 0, kMaskBytes);
    out += kMaskBytes;
    for (std::size_t i = 0; i < kWords; ++i) {
      const auto step = words[i] - before_[i];  // wraps, as it does on the way back
      if (step == 0) continue;
      mask[i / 8] = static_cast<char>(static_cast<unsigned char>(mask[i / 8]) | 1U << i % 8);
      out = put_varint(zigzag(static_cast<std::int64_t>(step)), out);
    }
    before_ = words;
    return out;
  }

  // Reads the record at `in`, which encode() wrote. Returns what follows.
  const char* decode(const char* in, Record& record) noexcept {
    const auto* const mask = in;
    in += kMaskBytes;
    for (std::size_t byte = 0; byte < kMaskBytes; ++byte) {
      for (unsigned bits = static_cast<unsigned char>(mask[byte]); bits != 0; bits &= bits - 1) {
        std::uint64_t number = 0;
        in = get_varint(in, number);
        before_[byte * 8 + static_cast<std::size_t>(std::countr_zero(bits))] +=
            static_cast<std::uint64_t>(unzigzag(number));
      }
    }
    std::memcpy(static_cast<void*>(&record), before_.data(), sizeof record);
    return in;
  }

 private:
  std::array<std::uint64_t, kWords> before_{};
};

}  // namespace cie::viewer_export
