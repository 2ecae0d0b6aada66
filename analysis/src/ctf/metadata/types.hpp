// What metadata says, of CTF 1.8 (TSDL) or 2 (JSON): types of fields, and the blocks that use them.
// Plain data; names are as written, except where said.
#pragma once

#include <cie/tracepoints/recording_layout.hpp>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis::ctf {

// A packet of a trace begins with it where the metadata has a field for it.
using cie::kPacketMagic;
// Metadata in packets does.
inline constexpr std::uint32_t kMetadataMagic = 0x75D11D57;

enum class ByteOrder : std::uint8_t { native, little, big };  // native: as the trace block says

struct Type;
using TypeRef = std::shared_ptr<const Type>;

struct NamedType {
  std::string name;
  TypeRef type;
};

// Values of one label, both ends included. Bits as the container has them: compare as signed or
// unsigned by its sign.
struct EnumerationRange {
  std::string label;
  std::uint64_t low = 0;
  std::uint64_t high = 0;
};

// What a field is for. CTF 2 says it with the field; in CTF 1.8 it is the field's name.
enum class Role : std::uint8_t {
  none,
  magic,
  metadata_uuid,
  stream_class,
  stream_instance,
  packet_size,
  content_size,
  time,  // of the stream's clock, when the packet or event begins
  packet_end_time,
  discarded_events,
  packet_sequence,
  event_class
};

// Where CTF 2 says that a length or selector lies. The place must be one that was read before.
struct FieldLocation {
  std::string origin;  // the scope, by the name it has in CTF 1.8; empty: the structure around
  std::vector<std::optional<std::string>> path;  // members; empty ones go to the structure around
};

// Values of a selector for which an option is chosen, both ends included.
struct Selection {
  __extension__ using Wide = __int128;  // of integers with and without sign
  std::size_t option = 0;
  Wide low = 0;
  Wide high = 0;
};

struct Type {
  enum class Kind : std::uint8_t {
    integer,
    real,  // or what is too long to be a number: only its size counts
    enumeration,
    string,
    structure,
    variant,
    array,
    sequence,
    // CTF 2 only
    boolean,
    bits,      // a number, but no length or selector
    leb128,    // an integer of variable length, maybe with labels
    optional,  // there or not
  };
  Kind kind = Kind::integer;
  std::uint32_t align = 1;  // bits; a structure's covers its members
  std::uint32_t depth = 1;  // levels below and including this one

  // integer, real; an enumeration repeats its container's
  std::uint32_t size = 0;  // bits
  bool is_signed = false;
  bool is_text = false;         // a character: arrays of them are texts
  bool is_hexadecimal = false;  // as it wants to be shown
  bool is_reversed = false;     // its first bit is the one that its byte order makes the last
  ByteOrder byte_order = ByteOrder::native;
  std::string clock{};  // it is a time of this clock; empty: of none

  std::vector<EnumerationRange> ranges{};  // enumeration
  std::vector<NamedType> members{};        // structure, variant (its options)
  std::string reference{};                 // variant: tag; sequence: length
  TypeRef element{};                       // array, sequence, optional
  std::uint64_t length = 0;                // array

  // CTF 2
  std::vector<Role> roles{};
  std::shared_ptr<const FieldLocation> location{};  // instead of `reference`
  std::vector<Selection> selections{};  // variant, optional; an optional without goes by a boolean
  bool is_wide_text = false;            // a text whose characters are UTF-16 or UTF-32: `size` bits
};

struct Clock {
  std::string name;
  std::string description;
  std::string uuid;  // CTF 2: whatever tells that two clocks are one
  std::uint64_t frequency = 1'000'000'000;
  std::int64_t offset_s = 0;
  std::int64_t offset = 0;  // cycles
};

// Reads types that were left unread in the metadata's text, which it owns.
class TypeReader {
 public:
  TypeReader() = default;
  TypeReader(const TypeReader&) = delete;
  TypeReader& operator=(const TypeReader&) = delete;
  virtual ~TypeReader() = default;
  // Throws MetadataError.
  virtual TypeRef read(std::string_view type) = 0;
};

struct EventClass {
  std::string name;
  std::uint64_t id = 0;
  std::uint64_t stream = 0;
  TypeRef context;  // null where there is none
  TypeRef fields;
  // Instead of `fields`, if not empty: of the reader's text. They refer to nothing outside, and the
  // class has no context of its own.
  std::string_view unread_fields{};
  std::string malformed{};  // why its context or fields cannot be understood; empty: they can
};

struct StreamClass {
  std::uint64_t id = 0;
  TypeRef packet_context;
  TypeRef event_header;
  TypeRef event_context;
  std::string clock{};  // CTF 2: the name of its only clock; CTF 1.8 has it in the types
};

struct Metadata {
  // CTF 2: fields of headers and of the packet context are known by their roles, and no name of a
  // field begins with an underscore that is none of its own.
  bool has_roles = false;
  ByteOrder byte_order = ByteOrder::little;
  std::string uuid;  // as text, lower case; empty if the trace has none
  TypeRef packet_header;
  std::map<std::string, std::string> environment;
  std::vector<Clock> clocks;
  std::map<std::uint64_t, StreamClass> streams;
  std::vector<EventClass> events;
  std::shared_ptr<TypeReader> reader{};  // of `unread_fields`; null: there are none
};

}  // namespace cie::analysis::ctf
