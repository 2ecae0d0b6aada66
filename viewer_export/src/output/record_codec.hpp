// Records that resemble the ones before them, as few bytes: what is spilled to disk costs what is
// written and read again.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace cie::viewer_export {

// A record as words of 64 bits: which of them differ from those of the record before, and by how
// much (LEB128, zigzag). One object for each sequence and direction.
template <typename Record>
class RecordCodec {
  static_assert(std::is_trivially_copyable_v<Record>);
  static constexpr std::size_t kWords = (sizeof(Record) + 7) / 8;
  static constexpr std::size_t kMaskBytes = (kWords + 7) / 8;
  static constexpr std::size_t kLongestNumber = 10;

 public:
  // An encoded record is never longer.
  static constexpr std::size_t kMostBytes = kMaskBytes + kWords * kLongestNumber;

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
      out = put(zigzag(step), out);
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
        in = get(in, number);
        before_[byte * 8 + static_cast<std::size_t>(std::countr_zero(bits))] += unzigzag(number);
      }
    }
    std::memcpy(static_cast<void*>(&record), before_.data(), sizeof record);
    return in;
  }

 private:
  static constexpr std::uint64_t zigzag(std::uint64_t step) noexcept {
    return step << 1U ^ (step >> 63U != 0 ? ~std::uint64_t{0} : 0);
  }
  static constexpr std::uint64_t unzigzag(std::uint64_t number) noexcept {
    return number >> 1U ^ (~(number & 1U) + 1);
  }
  static char* put(std::uint64_t number, char* out) noexcept {
    for (; number >= 0x80; number >>= 7U)
      *out++ = static_cast<char>((number & 0x7fU) | 0x80U);
    *out++ = static_cast<char>(number);
    return out;
  }
  static const char* get(const char* in, std::uint64_t& number) noexcept {
    for (unsigned shift = 0;; shift += 7) {
      const auto byte = static_cast<unsigned char>(*in++);
      number |= std::uint64_t{byte & 0x7fU} << shift;
      if (byte < 0x80 || shift >= 63) return in;
    }
  }

  std::array<std::uint64_t, kWords> before_{};
};

}  // namespace cie::viewer_export
