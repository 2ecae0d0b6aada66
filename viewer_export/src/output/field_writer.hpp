// Protobuf fields written to memory of known size, for messages of which there are millions;
// protozero's own writers look after a buffer's size at every byte.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

#include <protozero/types.hpp>
#include <protozero/varint.hpp>

namespace cie::viewer_export {

// Bytes that grow at their end: first room is asked for, then it is written to.
class EncodedBytes {
 public:
  // Where to write up to `size` bytes. Valid until the next call.
  char* room(std::size_t size) {
    if (bytes_.size() - size_ < size) bytes_.resize(2 * bytes_.size() + size);
    return bytes_.data() + size_;
  }
  // What was written ends here.
  void end_at(const char* end) noexcept { size_ = static_cast<std::size_t>(end - bytes_.data()); }
  void append(std::string_view bytes) {
    auto* const at = room(bytes.size());
    std::memcpy(at, bytes.data(), bytes.size());
    end_at(at + bytes.size());
  }
  void clear() noexcept { size_ = 0; }
  std::string_view view() const noexcept { return {bytes_.data(), size_}; }

 private:
  std::vector<char> bytes_ = std::vector<char>(512);
  std::size_t size_ = 0;
};

// `field` is an enumerator with a field's number. The caller sees to it that there is room.
class FieldWriter {
 public:
  static constexpr std::size_t kMostKey = 2;  // bytes of a field's number and type
  static constexpr std::size_t kMostNumber = kMostKey + protozero::max_varint_length;
  static constexpr std::size_t kFixed64 = kMostKey + sizeof(std::uint64_t);

  explicit FieldWriter(char* at) noexcept : at_(at) {}
  // Behind what was written.
  char* at() const noexcept { return at_; }

  // int32, int64 and enumerations as what they are cast to uint64.
  template <auto field>
  void number(std::uint64_t value) noexcept {
    key<field, protozero::pbf_wire_type::varint>();
    put(value);
  }
  template <auto field>
  void fixed64(std::uint64_t value) noexcept {
    static_assert(std::endian::native == std::endian::little);
    key<field, protozero::pbf_wire_type::fixed64>();
    std::memcpy(at_, &value, sizeof value);
    at_ += sizeof value;
  }
  template <auto field>
  void text(std::string_view bytes) noexcept {
    key<field, protozero::pbf_wire_type::length_delimited>();
    put(bytes.size());
    raw(bytes);
  }
  void raw(std::string_view bytes) noexcept {
    std::memcpy(at_, bytes.data(), bytes.size());
    at_ += bytes.size();
  }
  // A message whose fields are what `fill` writes. Its length takes one byte, mostly: of a longer
  // one the fields are moved.
  template <auto field, typename Fill>
  void message(const Fill& fill) {
    key<field, protozero::pbf_wire_type::length_delimited>();
    auto* const length = at_++;
    fill();
    const auto size = static_cast<std::size_t>(at_ - length) - 1;
    if (size < 0x80) {
      *length = static_cast<char>(size);
      return;
    }
    const auto more = static_cast<std::size_t>(protozero::length_of_varint(size)) - 1;
    std::memmove(length + 1 + more, length + 1, size);
    protozero::add_varint_to_buffer(length, size);
    at_ += more;
  }

 private:
  template <auto field, protozero::pbf_wire_type type>
  void key() noexcept {
    constexpr auto kKey =
        static_cast<std::uint32_t>(field) << 3U | static_cast<std::uint32_t>(type);
    static_assert(kKey < 0x4000);
    if constexpr (kKey < 0x80) {
      *at_++ = static_cast<char>(kKey);
    } else {
      *at_++ = static_cast<char>((kKey & 0x7fU) | 0x80U);
      *at_++ = static_cast<char>(kKey >> 7U);
    }
  }
  void put(std::uint64_t value) noexcept { at_ += protozero::add_varint_to_buffer(at_, value); }

  char* at_;
};

}  // namespace cie::viewer_export
