// Which number each class of events has in a channel whose metadata is lost, found by trying.
#pragma once

#include "provider_schema.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace cie::analysis::ctf {

// The events of a packet of LTTng-UST with the contexts vpid and vtid, as bytes.
struct PacketBytes {
  std::uint64_t begin = 0;  // times of its header; an end below the begin is none
  std::uint64_t end = 0;
  std::vector<std::uint8_t> events;
};

// Classes by id, as their places in a list; those of ids that occur.
using Numbering = std::map<std::uint64_t, std::size_t>;

// How `classes` must be numbered for all events of the packets to have plausible contents and to
// fill the packets exactly. Throws MetadataError if none fits, or several do.
Numbering find_numbering(std::span<const PacketBytes> packets,
                         std::span<const ProviderEvent> classes);
// What the first run_begin says about where it was recorded. Empty: there is none.
struct RecordedOn {
  std::string host;
  std::string boot_id;
  std::int64_t clock_offset_ns = 0;  // CLOCK_REALTIME - CLOCK_MONOTONIC
};
std::optional<RecordedOn> recorded_on(std::span<const PacketBytes> packets,
                                      std::span<const ProviderEvent> classes,
                                      const Numbering& numbering);

}  // namespace cie::analysis::ctf
