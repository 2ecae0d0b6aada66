// What Perfetto shows of a slice when it is selected.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/tracepoints/schema.hpp>

#include "output/field_writer.hpp"
#include "perfetto_fields.hpp"
#include "timelines/notes.hpp"

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace cie::viewer_export::perfetto {

// Names of notes and words that are their values go by number.
constexpr std::uint64_t iid_of(Note note) noexcept { return static_cast<std::uint64_t>(note) + 1; }

// Enumerations whose labels are such words: how many there are, and the number of the first.
template <typename Enum>
struct Words;
template <>
struct Words<analysis::ReleaseSource> {
  static constexpr std::uint64_t kFirst = 1;
  static constexpr std::uint64_t kCount =
      static_cast<std::uint64_t>(analysis::ReleaseSource::mixed) + 1;
};
template <>
struct Words<CallbackStatus> {
  static constexpr auto kFirst =
      Words<analysis::ReleaseSource>::kFirst + Words<analysis::ReleaseSource>::kCount;
  static constexpr std::uint64_t kCount = static_cast<std::uint64_t>(CallbackStatus::exception) + 1;
};
template <>
struct Words<analysis::InstanceState> {
  static constexpr auto kFirst = Words<CallbackStatus>::kFirst + Words<CallbackStatus>::kCount;
  static constexpr std::uint64_t kCount =
      static_cast<std::uint64_t>(analysis::InstanceState::cut_by_window) + 1;
};

// Logical ids are such words, too: the number of the first.
inline constexpr auto kFirstLogicalId =
    Words<analysis::InstanceState>::kFirst + Words<analysis::InstanceState>::kCount;

class Annotations {
 public:
  void add(Note note, std::int64_t value) {
    add_number<DebugAnnotation::int_value>(note, static_cast<std::uint64_t>(value));
  }
  void add(Note note, std::uint64_t value) { add_number<DebugAnnotation::uint_value>(note, value); }
  void add(Note note, std::string_view value) {
    add_value(note, value.size(),
              [value](FieldWriter& out) { out.text<DebugAnnotation::string_value>(value); });
  }
  // Values of one of the enumerations above.
  template <typename Enum>
  requires std::is_enum_v<Enum>
  void add(Note note, Enum value) {
    const auto number = static_cast<std::uint64_t>(value);
    if (number < Words<Enum>::kCount) {
      add_number<DebugAnnotation::string_value_iid>(note, Words<Enum>::kFirst + number);
    } else {
      add(note, std::string_view(label(value)));
    }
  }
  // A logical id by its place among those that were interned.
  void add_logical_id(std::uint32_t place) {
    add_number<DebugAnnotation::string_value_iid>(Note::logical_id, kFirstLogicalId + place);
  }
  void clear() noexcept { bytes_.clear(); }
  // Fields of a TrackEvent.
  std::string_view bytes() const noexcept { return bytes_.view(); }

 private:
  template <DebugAnnotation field>
  void add_number(Note note, std::uint64_t value) {
    add_value(note, 0, [value](FieldWriter& out) { out.number<field>(value); });
  }
  // `write` writes a number, or a text of `length` bytes.
  template <typename Write>
  void add_value(Note note, std::size_t length, const Write& write) {
    constexpr auto kMost = 4 * FieldWriter::kMostNumber;  // the annotation, its name and its value
    FieldWriter out(bytes_.room(kMost + length));
    out.message<TrackEvent::debug_annotations>([&] {
      out.number<DebugAnnotation::name_iid>(iid_of(note));
      write(out);
    });
    bytes_.end_at(out.at());
  }

  EncodedBytes bytes_;
};

}  // namespace cie::viewer_export::perfetto
