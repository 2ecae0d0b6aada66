#include "event_numbering.hpp"

#include "ctf/metadata/tokens.hpp"
#include "ctf/stream/event_cursor.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

namespace cie::analysis::ctf {
namespace {

using Kind = ProviderField::Kind;

constexpr std::uint64_t kMaxSteps = 20'000'000;  // events tried
constexpr std::uint32_t kMaxCpus = 65'536;
constexpr std::int64_t kMaxTid = 1 << 22;  // PID_MAX_LIMIT of Linux
constexpr std::uint16_t kExtended = 0xffff;
// Counts are below, times of the day above (a quarter of an hour after 1970 is).
constexpr std::uint64_t kLargestCount = std::uint64_t{1} << 40U;

// Reads little-endian values one after the other. After a failure all of it has failed.
class Bytes {
 public:
  Bytes(const std::vector<std::uint8_t>& bytes, std::size_t at) : bytes_(bytes), at_(at) {}

  template <typename Integer>
  Integer take() {
    Integer value{};
    if (!skip(sizeof value)) return value;
    std::memcpy(&value, bytes_.data() + at_ - sizeof value, sizeof value);
    return value;
  }
  bool skip(std::size_t size) {
    is_good_ = is_good_ && bytes_.size() - at_ >= size;
    if (is_good_) at_ += size;
    return is_good_;
  }
  // Up to a NUL; what is no text has control characters.
  std::string_view text() {
    const auto* begin = reinterpret_cast<const char*>(bytes_.data()) + at_;
    const auto length = is_good_ ? ::strnlen(begin, bytes_.size() - at_) : 0;
    if (!skip(length + 1)) return {};
    const bool is_text = std::all_of(begin, begin + length, [](char c) {
      return static_cast<unsigned char>(c) >= ' ' && c != '\x7f';
    });
    is_good_ = is_text;
    return {begin, length};
  }
  bool is_good() const { return is_good_; }
  std::size_t at() const { return at_; }

 private:
  const std::vector<std::uint8_t>& bytes_;
  std::size_t at_;
  bool is_good_ = true;
};

bool skip(Bytes& bytes, const ProviderField& field) {
  switch (field.kind) {
    case Kind::u32:
    case Kind::i32:
      return bytes.skip(4);
    case Kind::u64:
    case Kind::i64:
      return bytes.skip(8);
    case Kind::count:
      return bytes.take<std::uint64_t>() < kLargestCount && bytes.is_good();
    case Kind::realtime:
    case Kind::realtime_or_nothing: {
      const auto time = bytes.take<std::uint64_t>();
      const bool is_none = time == 0 && field.kind == Kind::realtime_or_nothing;
      return (is_none || time >= kLargestCount) && bytes.is_good();
    }
    case Kind::label:
      return bytes.take<std::uint8_t>() < field.labels.size() && bytes.is_good();
    case Kind::text:
      bytes.text();
      return bytes.is_good();
    case Kind::u32_sequence: {
      const auto length = bytes.take<std::uint32_t>();
      return length <= kMaxCpus && bytes.skip(std::size_t{length} * 4);
    }
    case Kind::characters:
      return bytes.skip(field.length);
  }
  return false;
}

class Search {
 public:
  Search(std::span<const PacketBytes> packets, std::span<const ProviderEvent> classes)
      : packets_(packets), classes_(classes), is_taken_(classes.size(), false) {}

  void assign(std::uint64_t id, std::size_t number) {
    assigned_[id] = number;
    is_taken_[number] = true;
  }
  // Where the first event of an assigned class has its fields: packet and byte.
  std::optional<std::pair<std::size_t, std::size_t>> first_of(std::size_t number) {
    wanted_ = number;
    run();
    return first_wanted_;
  }
  // Tries all that fits. Two solutions are as many as anybody wants.
  void run() { follow({.packet = 0, .at = 0, .clock = begin_of(0)}); }
  const std::vector<Numbering>& solutions() const { return solutions_; }
  bool is_complete() const { return steps_ <= kMaxSteps; }

 private:
  struct Place {
    std::size_t packet = 0;
    std::size_t at = 0;
    std::uint64_t clock = 0;
  };
  struct Header {
    std::uint64_t id = 0;
    std::size_t end = 0;
    std::uint64_t clock = 0;
  };

  std::uint64_t begin_of(std::size_t packet) const {
    return packet < packets_.size() ? packets_[packet].begin : 0;
  }

  // Empty: no event can begin there.
  std::optional<Header> header_at(const Place& place) const {
    const auto& packet = packets_[place.packet];
    Bytes bytes(packet.events, place.at);
    Header header{.id = bytes.take<std::uint16_t>(), .end = 0, .clock = 0};
    if (header.id == kExtended) {
      header.id = bytes.take<std::uint32_t>();
      header.clock = bytes.take<std::uint64_t>();
    } else {
      header.clock = extend_clock(place.clock, bytes.take<std::uint32_t>(), 32);
    }
    const auto pid = bytes.take<std::int32_t>();
    const auto tid = bytes.take<std::int32_t>();
    const bool is_in_time =
        header.clock >= place.clock && (packet.end < packet.begin || header.clock <= packet.end);
    const bool has_thread = pid > 0 && pid <= kMaxTid && tid > 0 && tid <= kMaxTid;
    if (!bytes.is_good() || !is_in_time || !has_thread) return std::nullopt;
    header.end = bytes.at();
    return header;
  }

  // Where the event ends if its fields can be those of a class.
  std::optional<std::size_t> end_of(const Place& place, std::size_t body,
                                    const ProviderEvent& event) const {
    Bytes bytes(packets_[place.packet].events, body);
    const bool fits = std::all_of(event.fields.begin(), event.fields.end(),
                                  [&bytes](const auto& field) { return skip(bytes, field); });
    return fits ? std::optional(bytes.at()) : std::nullopt;
  }

  void follow(Place place) {
    while (solutions_.size() < 2 && steps_ <= kMaxSteps) {
      ++steps_;
      if (place.packet == packets_.size()) {
        solutions_.push_back(assigned_);
        return;
      }
      if (place.at == packets_[place.packet].events.size()) {
        ++place.packet;
        place = {.packet = place.packet, .at = 0, .clock = begin_of(place.packet)};
        continue;
      }
      const auto header = header_at(place);
      if (!header) return;
      const auto known = assigned_.find(header->id);
      if (known == assigned_.end()) {
        try_classes(place, *header);
        return;
      }
      if (known->second == wanted_ && !first_wanted_) {
        first_wanted_ = {place.packet, header->end};
      }
      const auto end = end_of(place, header->end, classes_[known->second]);
      if (!end) return;
      place.at = *end;
      place.clock = header->clock;
    }
  }

  // As deep as there are classes.
  void try_classes(const Place& place, const Header& header) {
    if (header.id >= classes_.size()) return;  // ids are given from 0 on
    for (std::size_t i = 0; i < classes_.size(); ++i) {
      if (is_taken_[i]) continue;
      const auto end = end_of(place, header.end, classes_[i]);
      if (!end) continue;
      assign(header.id, i);
      follow({.packet = place.packet, .at = *end, .clock = header.clock});
      assigned_.erase(header.id);
      is_taken_[i] = false;
    }
  }

  std::span<const PacketBytes> packets_;
  std::span<const ProviderEvent> classes_;
  Numbering assigned_;
  std::vector<bool> is_taken_;
  std::vector<Numbering> solutions_;
  std::uint64_t steps_ = 0;
  std::optional<std::size_t> wanted_;
  std::optional<std::pair<std::size_t, std::size_t>> first_wanted_;
};

}  // namespace

Numbering find_numbering(std::span<const PacketBytes> packets,
                         std::span<const ProviderEvent> classes) {
  Search search(packets, classes);
  search.run();
  if (!search.is_complete()) throw MetadataError("too much would have to be tried");
  if (search.solutions().empty()) throw MetadataError("its events are none of cie's");
  if (search.solutions().size() > 1) {
    throw MetadataError("its events can be understood in more than one way");
  }
  return search.solutions().front();
}

std::optional<RecordedOn> recorded_on(std::span<const PacketBytes> packets,
                                      std::span<const ProviderEvent> classes,
                                      const Numbering& numbering) {
  const auto run_begin =
      std::ranges::find(classes, std::string_view("cie:run_begin"), &ProviderEvent::name);
  if (run_begin == classes.end()) return std::nullopt;
  Search search(packets, classes);
  for (const auto& [id, number] : numbering)
    search.assign(id, number);
  const auto found = search.first_of(static_cast<std::size_t>(run_begin - classes.begin()));
  if (!found) return std::nullopt;
  Bytes bytes(packets[found->first].events, found->second);
  RecordedOn result;
  std::int64_t monotonic = 0;
  for (const auto& field : run_begin->fields) {
    if (field.name == "boot_id") {
      result.boot_id = bytes.text();
    } else if (field.name == "host") {
      result.host = bytes.text();
    } else if (field.name == "monotonic_ns") {
      monotonic = bytes.take<std::int64_t>();
    } else if (field.name == "realtime_ns") {
      result.clock_offset_ns = detail::wrapping_sub(bytes.take<std::int64_t>(), monotonic);
    } else {
      skip(bytes, field);
    }
  }
  return result;
}

}  // namespace cie::analysis::ctf
