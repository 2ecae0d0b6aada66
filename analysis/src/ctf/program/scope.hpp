// Turns the types of a scope into the program that reads it, and finds what lengths and tags refer
// to.
#pragma once

#include "ctf/metadata/types.hpp"
#include "program.hpp"
#include "vocabulary/field.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis::ctf {

class EventChoice;

// Registers of one life time: those of the packet header, of a stream, of an event.
struct RegisterRange {
  std::int16_t next = 0;
  std::int16_t end = 0;
};

// What all scopes of a trace share: owns label tables and bodies, bounds the whole.
struct BuildContext {
  ByteOrder byte_order = ByteOrder::little;
  bool has_roles = false;   // see Metadata
  std::size_t fields = 0;   // laid out so far, and the labels and choices they come with
  std::size_t lookups = 0;  // names compared so far
  std::vector<std::unique_ptr<const LabelTable>> labels{};
  std::vector<std::shared_ptr<Sequence>> bodies{};  // of loops and options: names point into them
};

// A field that a reference can name, and how to keep its value.
class ScopeNames;

// One scope: its program and its names. Scopes are built in the order in which they stand in a
// packet; later ones refer to `earlier`. Everything borrowed outlives the scope.
class Scope {
 public:
  // `root` is the scope's full name, "stream.event.header".
  Scope(std::string_view root, BuildContext& context, RegisterRange& registers,
        std::vector<Scope*> earlier);
  ~Scope();
  Scope(const Scope&) = delete;
  Scope& operator=(const Scope&) = delete;

  // Compiles `type` (null: an empty scope) with the top-level members that `requests` ask for in
  // their slots. Where metadata has roles, slots with one (`roles`, by slot) are for the fields
  // that have it, wherever they stand. Throws MetadataError.
  void build(const TypeRef& type, std::span<const FieldRequest> requests,
             std::span<const Role> roles = {});
  // The same, with a program that shows all fields, too, which `choice` keeps.
  void build_shown(const TypeRef& type, std::span<const FieldRequest> requests,
                   EventChoice& choice);
  // The same for an event header: slot 0 is the id, slot 1 the time, wherever they stand.
  void build_header(const TypeRef& type);

  // Complete once all scopes that may refer to this one are built.
  const Sequence& program() const noexcept { return *program_; }
  std::shared_ptr<const Sequence> shared_program() const noexcept { return program_; }
  // Whether the slot is ever filled, and the clock that the type of its field names.
  bool has_slot(std::size_t slot) const noexcept;
  const std::string& clock_of_slot(std::size_t slot) const noexcept { return slots_[slot].clock; }

 private:
  friend class ScopeBuilder;
  friend class References;
  struct Slot {
    bool is_filled = false;
    std::string clock;
  };

  std::string root_;
  BuildContext& context_;
  RegisterRange& registers_;
  std::vector<Scope*> earlier_;
  std::shared_ptr<Sequence> program_;
  std::unique_ptr<ScopeNames> names_;
  std::vector<Slot> slots_;
};

}  // namespace cie::analysis::ctf
