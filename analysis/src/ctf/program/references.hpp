// What lengths, tags and selectors refer to, and the registers that keep the values until then.
#pragma once

#include "ctf/metadata/types.hpp"
#include "scope.hpp"
#include "scope_names.hpp"

#include <cstdint>
#include <string_view>
#include <vector>

namespace cie::analysis::ctf {

// How a number of whole bytes lies in memory. `trace_order`: what "native" means.
Load load_of(const Type& type, ByteOrder trace_order);

// Part of laying out one scope.
class References {
 public:
  explicit References(Scope& scope) : scope_(scope) {}

  // Structures and variants around what is laid out, which CTF 1.8 looks through.
  void enter(ScopeNames& around) { around_.push_back(&around); }
  void leave() { around_.pop_back(); }
  ScopeNames& innermost() const { return *around_.back(); }

  // The numbers that `type`, the type of `from`, refers to: one, or one for each option of a
  // variant (CTF 2). Throws MetadataError if there is none.
  std::vector<ScopeNames*> find(const ScopeNames& from, const Type& type);
  // The register that keeps their value; reading it becomes part of their scope's program.
  std::int16_t keep(const std::vector<ScopeNames*>& found);

 private:
  ScopeNames* find_by_name(std::string_view reference);
  ScopeNames* find_absolute(std::string_view path);
  ScopeNames* walk(ScopeNames* node, std::string_view path);
  ScopeNames* member_of(const ScopeNames& node, std::string_view name);
  std::vector<ScopeNames*> find_by_location(const ScopeNames& from, const FieldLocation& location);
  ScopeNames* origin_of(const ScopeNames& from, const FieldLocation& location) const;
  void add_values(ScopeNames& node, std::vector<ScopeNames*>& values);
  void keep_in(ScopeNames& found, std::int16_t reg);
  RegisterRange& registers_of(const ScopeNames& names);
  void count(std::size_t lookups);

  Scope& scope_;
  std::vector<ScopeNames*> around_;
};

}  // namespace cie::analysis::ctf
