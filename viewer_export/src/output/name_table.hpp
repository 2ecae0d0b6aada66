// Strings kept once, known by a small number.
#pragma once

#include <cie/analysis/identity.hpp>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace cie::viewer_export {

class NameTable {
 public:
  // The number of a name; numbers are dense and given in order of first use.
  std::uint32_t number(std::string_view name) {
    if (const auto at = numbers_.find(name); at != numbers_.end()) {
      return at->second;
    }
    const auto& kept = names_.emplace_back(name);  // a deque never moves its elements
    const auto number = static_cast<std::uint32_t>(names_.size() - 1);
    numbers_.emplace(kept, number);
    return number;
  }
  // The same for names that belong to small numbers of the caller's: asked again with the same one,
  // the name is compared instead of looked up.
  std::uint32_t number(std::string_view name, analysis::CallbackIndex owner) {
    return number_of(name, at(owner));
  }
  std::uint32_t number(std::string_view name, std::uint32_t owner) {
    return number_of(name, owner);
  }
  const std::string& name(std::uint32_t number) const { return names_.at(number); }
  std::size_t size() const noexcept { return names_.size(); }

 private:
  static constexpr std::uint32_t kNone = 0xffffffff;

  std::uint32_t number_of(std::string_view name, std::size_t owner) {
    constexpr std::size_t kMostOwners = 1U << 20U;
    if (owner >= kMostOwners) return number(name);
    if (owner >= by_owner_.size()) by_owner_.resize(owner + 1, kNone);
    auto& known = by_owner_[owner];
    if (known == kNone || names_[known] != name) known = number(name);
    return known;
  }

  std::vector<std::uint32_t> by_owner_;
  std::deque<std::string> names_;
  std::unordered_map<std::string_view, std::uint32_t> numbers_;
};

}  // namespace cie::viewer_export
