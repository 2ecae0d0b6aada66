// A Perfetto file read back field by field.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <protozero/pbf_reader.hpp>

namespace cie::test {

struct TrackEvent {
  std::uint64_t time = 0;
  std::uint64_t machine = 0;
  std::int64_t type = 0;  // 1 begin, 2 end, 3 instant, 4 counter
  std::uint64_t track = 0;
  std::uint64_t name = 0;
  std::int64_t value = 0;        // of a curve
  std::uint64_t more_track = 0;  // a curve that changes with it, and how
  std::int64_t more_value = 0;
  std::vector<std::uint64_t> flows;
  std::vector<std::uint64_t> ending_flows;
};

// Counted with field numbers written out, as protos/perfetto/trace has them.
struct File {
  std::vector<int> kinds;  // of each packet: the field that holds its payload
  std::vector<TrackEvent> events;
  std::map<std::uint64_t, std::string> thread_names;   // tid
  std::map<std::uint64_t, std::string> process_names;  // pid
  std::map<std::uint64_t, std::string> names;          // interned
  std::map<std::uint64_t, std::string> tracks;         // by uuid, where they have a name
  std::map<std::uint64_t, std::uint64_t> clocks;
  std::uint64_t primary_clock = 0;
  int switches = 0;
  int wakings = 0;
  std::set<std::uint64_t> machines;  // 0: not said
};

inline void read_descriptor(protozero::pbf_reader descriptor, File& file) {
  std::uint64_t uuid = 0;
  while (descriptor.next()) {
    if (descriptor.tag() == 1) uuid = descriptor.get_uint64();
    if (descriptor.tag() == 2) file.tracks[uuid] = descriptor.get_string();
    if (descriptor.tag() < 3) continue;
    if (descriptor.tag() != 3 && descriptor.tag() != 4) {
      descriptor.skip();
      continue;
    }
    const bool is_thread = descriptor.tag() == 4;
    auto owner = descriptor.get_message();
    std::uint64_t id = 0;
    std::string name;
    while (owner.next()) {
      if (owner.tag() == (is_thread ? 2U : 1U)) {
        id = static_cast<std::uint64_t>(owner.get_int32());
      } else if (owner.tag() == (is_thread ? 5U : 6U)) {
        name = owner.get_string();
      } else {
        owner.skip();
      }
    }
    (is_thread ? file.thread_names : file.process_names)[id] = name;
  }
}

inline void read_names(protozero::pbf_reader data, File& file) {
  while (data.next(2)) {
    auto entry = data.get_message();
    std::uint64_t iid = 0;
    while (entry.next()) {
      if (entry.tag() == 1) {
        iid = entry.get_uint64();
      } else {
        file.names[iid] = entry.get_string();
      }
    }
  }
}

inline TrackEvent read_event(protozero::pbf_reader message, std::uint64_t time) {
  TrackEvent event;
  event.time = time;
  while (message.next()) {
    switch (message.tag()) {
      case 9:
        event.type = message.get_enum();
        break;
      case 10:
        event.name = message.get_uint64();
        break;
      case 11:
        event.track = message.get_uint64();
        break;
      case 12:
        event.more_value = message.get_int64();
        break;
      case 30:
        event.value = message.get_int64();
        break;
      case 31:
        event.more_track = message.get_uint64();
        break;
      case 47:
        event.flows.push_back(message.get_fixed64());
        break;
      case 48:
        event.ending_flows.push_back(message.get_fixed64());
        break;
      default:
        message.skip();
    }
  }
  return event;
}

inline void read_clocks(protozero::pbf_reader snapshot, File& file) {
  while (snapshot.next()) {
    if (snapshot.tag() == 2) {
      file.primary_clock = snapshot.get_uint32();
      continue;
    }
    auto clock = snapshot.get_message();
    std::uint64_t id = 0;
    while (clock.next()) {
      const auto value = clock.get_uint64();
      (clock.tag() == 1 ? id : file.clocks[id]) = value;
    }
  }
}

inline File decode(const std::string& bytes) {
  File file;
  protozero::pbf_reader trace(bytes);
  while (trace.next(1)) {
    auto packet = trace.get_message();
    std::uint64_t time = 0;
    std::uint64_t machine = 0;
    const auto first_event = file.events.size();
    while (packet.next()) {
      const auto tag = static_cast<int>(packet.tag());
      if (std::set{1, 6, 11, 12, 45, 60}.contains(tag)) {
        file.kinds.push_back(tag);
      }
      switch (tag) {
        case 1: {
          auto bundle = packet.get_message();
          while (bundle.next(2)) {
            auto event = bundle.get_message();
            while (event.next()) {
              file.switches += event.tag() == 4 ? 1 : 0;
              file.wakings += event.tag() == 20 ? 1 : 0;
              event.skip();
            }
          }
          break;
        }
        case 6:
          read_clocks(packet.get_message(), file);
          break;
        case 8:
          time = packet.get_uint64();
          break;
        case 11:
          file.events.push_back(read_event(packet.get_message(), time));
          break;
        case 12:
          read_names(packet.get_message(), file);
          break;
        case 98:
          machine = packet.get_uint32();
          break;
        case 60:
          read_descriptor(packet.get_message(), file);
          break;
        default:
          packet.skip();
      }
    }
    file.machines.insert(machine);
    for (auto i = first_event; i < file.events.size(); ++i)
      file.events[i].machine = machine;
  }
  return file;
}

}  // namespace cie::test
