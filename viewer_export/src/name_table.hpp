// Strings kept once, known by a small number.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>

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
  const std::string& name(std::uint32_t number) const { return names_.at(number); }
  std::size_t size() const noexcept { return names_.size(); }

 private:
  std::deque<std::string> names_;
  std::unordered_map<std::string_view, std::uint32_t> numbers_;
};

}  // namespace cie::viewer_export
