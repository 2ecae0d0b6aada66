// The fields of events for whoever wants to see them: all that a type declares, with its names.
#pragma once

#include <cie/analysis/event.hpp>

#include "ctf/metadata/types.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis::ctf {

// A field as programs know it. Outlives what is shown of it.
struct ShownField {
  FieldValue::Kind kind{};
  std::string name;
  const Type* type = nullptr;  // of a label: its enumeration
  std::uint32_t size = 64;     // bits of a real
  bool is_hexadecimal = false;
};
// Of a field of that type. It points to the type if its values have labels.
ShownField shown_field(const Type& type, std::string name);

// Collects the values of one event. Texts are copied: what was read may move. Beyond kMaxElements
// values one that is opaque stands for the rest.
class ShownFields {
 public:
  void clear() noexcept;
  // What follows is no context.
  void end_context() noexcept { context_ = values_.size(); }

  void number(const ShownField& field, std::uint64_t bits);
  void text(const ShownField& field, const std::uint8_t* begin, std::size_t length);
  // Characters up to a NUL or the end, or a number that cannot be read.
  void packed(const ShownField& field, const std::uint8_t* begin, std::size_t length);
  void open(const ShownField& field);
  void close();

  // A scope that is read again from its begin takes back what it has shown.
  std::size_t size() const noexcept { return values_.size(); }
  void take_back(std::size_t size) {
    values_.resize(size);
    unshown_ = 0;
  }

  std::span<const FieldValue> values() const noexcept { return values_; }
  std::uint32_t context() const noexcept { return static_cast<std::uint32_t>(context_); }

 private:
  // Whether there is room for one more.
  bool has_room();

  std::vector<FieldValue> values_;
  std::size_t context_ = 0;
  std::size_t unshown_ = 0;  // structures and lists around, for which there was no room
  std::array<std::byte, 4096> room_{};
  std::pmr::monotonic_buffer_resource memory_{room_.data(), room_.size()};
};

}  // namespace cie::analysis::ctf
