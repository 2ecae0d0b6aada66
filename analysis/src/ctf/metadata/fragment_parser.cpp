#include "fragment_parser.hpp"

#include "base/uuid.hpp"
#include "field_class_parser.hpp"
#include "fragment_json.hpp"
#include "uuid.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace cie::analysis::ctf {
namespace {

Uuid uuid_of(const Json& bytes) {
  Uuid uuid{};
  if (bytes.size() != uuid.size()) throw MetadataError("a uuid must have 16 bytes");
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const auto value = integer_of(bytes[i]);
    if (value < 0 || value > 0xff) throw MetadataError("a uuid must have 16 bytes");
    uuid[i] = static_cast<std::uint8_t>(value);
  }
  return uuid;
}

// Two clocks are one if they agree in this: the id of the boot, as in CTF 1.8, or what CTF 2 calls
// their identity.
std::string identity_of(const Json& clock) {
  auto uid = text_property(clock, "uid", "");
  if (parse_uuid(uid)) return uid;
  const bool has_identity =
      find_property(clock, "name") != nullptr && find_property(clock, "uid") != nullptr;
  if (!has_identity) return {};
  return text_property(clock, "namespace", "") + '/' + text_property(clock, "name") + '/' + uid;
}

class FragmentParser {
 public:
  FragmentParser() { metadata_.has_roles = true; }

  void take(std::size_t number, const Json& fragment) {
    const auto kind = text_property(fragment, "type");
    if ((number == 1) != (kind == "preamble")) {
      throw MetadataError("the first fragment, and no other, must be a preamble");
    }
    if (kind == "preamble") {
      preamble(fragment);
    } else {
      refuse_extensions(fragment);
      if (kind == "field-class-alias") {
        types_.add_alias(text_property(fragment, "name"), property(fragment, "field-class"));
      } else if (kind == "trace-class") {
        trace_class(fragment);
      } else if (kind == "clock-class") {
        clock_class(fragment);
      } else if (kind == "data-stream-class") {
        stream_class(fragment);
      } else if (kind == "event-record-class") {
        event_class(fragment);
      } else {
        throw MetadataError("unknown type \"" + kind.substr(0, kShown) + '"');
      }
    }
  }

  Metadata finish() {
    if (metadata_.streams.empty()) throw MetadataError("there is no data stream class");
    return std::move(metadata_);
  }

 private:
  void preamble(const Json& fragment) {
    if (unsigned_property(fragment, "version") != 2) {
      throw MetadataError("only versions 1.8 and 2 of CTF are understood");
    }
    refuse_extensions(fragment);
    if (const auto* uuid = array_property(fragment, "uuid"))
      metadata_.uuid = uuid_text(uuid_of(*uuid));
  }

  void trace_class(const Json& fragment) {
    if (has_trace_ || !metadata_.streams.empty()) {
      throw MetadataError("the trace class must be the only one, before data stream classes");
    }
    has_trace_ = true;
    metadata_.packet_header = types_.structure_of(fragment, "packet-header-field-class");
    // A packet's begin is looked for in the byte order of its magic number.
    if (const auto& header = metadata_.packet_header; header && !header->members.empty()) {
      metadata_.byte_order = header->members.front().type->byte_order;
    }
    const auto* environment = object_property(fragment, "environment");
    if (environment == nullptr) return;
    for (const auto& [name, value] : environment->items()) {
      if (!value.is_string() && !value.is_number_integer()) {
        throw MetadataError("the environment must have strings and integers");
      }
      metadata_.environment[name] = value.is_string() ? value.get<std::string>() : value.dump();
    }
  }

  void clock_class(const Json& fragment) {
    Clock clock;
    clock.name = text_property(fragment, "id");
    clock.description = text_property(fragment, "description", "");
    clock.uuid = identity_of(fragment);
    clock.frequency = unsigned_property(fragment, "frequency");
    if (clock.frequency == 0) throw MetadataError("a clock must advance");
    unsigned_property(fragment, "precision", 0);
    unsigned_property(fragment, "accuracy", 0);
    if (const auto* origin = find_property(fragment, "origin")) check_origin(*origin);
    if (const auto* offset = object_property(fragment, "offset-from-origin")) {
      clock.offset_s = signed_property(*offset, "seconds", 0);
      const auto cycles = unsigned_property(*offset, "cycles", 0);
      if (cycles >= clock.frequency) {
        throw MetadataError("the cycles of a clock's offset must be less than a second");
      }
      clock.offset = static_cast<std::int64_t>(cycles);
    }
    if (clock.name.empty() || !clock_ids_.insert(clock.name).second) {
      throw MetadataError("a clock needs an id of its own");
    }
    metadata_.clocks.push_back(std::move(clock));
  }

  static void check_origin(const Json& origin) {
    if (origin.is_object()) {
      text_property(origin, "namespace", "");
      text_property(origin, "name");
      text_property(origin, "uid");
    } else if (!origin.is_string() || origin.get<std::string>() != "unix-epoch") {
      throw MetadataError("unknown origin of a clock");
    }
  }

  void stream_class(const Json& fragment) {
    StreamClass stream;
    stream.id = unsigned_property(fragment, "id", 0);
    stream.packet_context = types_.structure_of(fragment, "packet-context-field-class");
    stream.event_header = types_.structure_of(fragment, "event-record-header-field-class");
    stream.event_context = types_.structure_of(fragment, "event-record-common-context-field-class");
    stream.clock = text_property(fragment, "default-clock-class-id", "");
    if (!stream.clock.empty() && !clock_ids_.contains(stream.clock)) {
      throw MetadataError("unknown clock \"" + stream.clock.substr(0, kShown) + '"');
    }
    const auto id = stream.id;
    if (!metadata_.streams.emplace(id, std::move(stream)).second) {
      throw MetadataError("a second data stream class " + std::to_string(id));
    }
  }

  void event_class(const Json& fragment) {
    EventClass event;
    event.id = unsigned_property(fragment, "id", 0);
    event.stream = unsigned_property(fragment, "data-stream-class-id", 0);
    event.name = text_property(fragment, "name", "");
    try {
      event.context = types_.structure_of(fragment, "specific-context-field-class");
      event.fields = types_.structure_of(fragment, "payload-field-class");
    } catch (const MetadataError& error) {
      event.malformed = error.what();  // the rest of the metadata can be understood
    }
    if (!metadata_.streams.contains(event.stream)) {
      throw MetadataError("event \"" + event.name.substr(0, kShown) + "\" is of stream " +
                          std::to_string(event.stream) + ", which is not declared");
    }
    if (!event_ids_.emplace(event.stream, event.id).second) {
      throw MetadataError("a second event " + std::to_string(event.id) + " of stream " +
                          std::to_string(event.stream));
    }
    metadata_.events.push_back(std::move(event));
  }

  FieldClassParser types_;
  Metadata metadata_;
  std::set<std::string> clock_ids_;
  std::set<std::pair<std::uint64_t, std::uint64_t>> event_ids_;
  bool has_trace_ = false;
};

}  // namespace

Metadata parse_fragments(std::string_view sequence) {
  FragmentParser parser;
  each_fragment(sequence, [&parser](std::size_t number, const Json& fragment) {
    parser.take(number, fragment);
  });
  return parser.finish();
}

}  // namespace cie::analysis::ctf
