// A trace as babeltrace2 prints it: the tests read recordings with a reader that is not ours.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace cie::test {

struct TextEvent {
  std::string name;  // without the provider
  std::string text;  // contexts and payload

  bool has(std::string_view field) const;
  // Integer of the field; throws std::out_of_range naming the field if it is absent.
  std::int64_t integer(std::string_view field) const;
  // Text of a string field, or label of an enumeration.
  std::string label(std::string_view field) const;
};

struct TextTrace {
  std::vector<TextEvent> events;  // of provider cie, in order of time
  bool is_readable = false;       // babeltrace2 exited with 0

  std::vector<TextEvent> all(std::string_view name) const;
  // Of one process.
  TextTrace of(std::int64_t vpid) const;
};

TextTrace read_trace(const std::filesystem::path& directory);

}  // namespace cie::test
