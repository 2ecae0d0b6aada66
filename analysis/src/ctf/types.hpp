// What CTF 1.8 metadata says: types of fields, and the blocks that use them. Plain data; names are
// as written, except where said.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cie::analysis::ctf {

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

struct Type {
  enum class Kind : std::uint8_t {
    integer,
    real,
    enumeration,
    string,
    structure,
    variant,
    array,
    sequence
  };
  Kind kind = Kind::integer;
  std::uint32_t align = 1;  // bits; a structure's covers its members
  std::uint32_t depth = 1;  // levels below and including this one

  // integer, real; an enumeration repeats its container's
  std::uint32_t size = 0;  // bits
  bool is_signed = false;
  bool is_text = false;  // a character: arrays of them are texts
  ByteOrder byte_order = ByteOrder::native;
  std::string clock{};  // it is a time of this clock; empty: of none

  std::vector<EnumerationRange> ranges{};  // enumeration
  std::vector<NamedType> members{};        // structure, variant (its options)
  std::string reference{};                 // variant: tag; sequence: length
  TypeRef element{};                       // array, sequence
  std::uint64_t length = 0;                // array
};

struct Clock {
  std::string name;
  std::string description;
  std::string uuid;
  std::uint64_t frequency = 1'000'000'000;
  std::int64_t offset_s = 0;
  std::int64_t offset = 0;  // cycles
};

struct EventClass {
  std::string name;
  std::uint64_t id = 0;
  std::uint64_t stream = 0;
  TypeRef context;  // null where there is none
  TypeRef fields;
};

struct StreamClass {
  std::uint64_t id = 0;
  TypeRef packet_context;
  TypeRef event_header;
  TypeRef event_context;
};

struct Metadata {
  ByteOrder byte_order = ByteOrder::little;
  std::string uuid;  // as text, lower case; empty if the trace has none
  TypeRef packet_header;
  std::map<std::string, std::string> environment;
  std::vector<Clock> clocks;
  std::map<std::uint64_t, StreamClass> streams;
  std::vector<EventClass> events;
};

}  // namespace cie::analysis::ctf
