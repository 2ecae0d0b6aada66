// What logical ids of one process have in common. See cie/tracepoints/logical_id.hpp.
#pragma once

#include <cstdint>
#include <string_view>

namespace cie::analysis {

// An id's node and what is known of the callback beside it; without its number. Traces may hold any
// text for an id. Views into the id.
struct IdParts {
  explicit IdParts(std::string_view id);
  bool lacks_node() const { return node == "?"; }

  std::string_view node;           // "/node"
  std::string_view kind_and_what;  // "@Timer(10)"
};

// That of "#2"; 1 if it has none. Saturates.
std::uint32_t id_number(std::string_view id) noexcept;

}  // namespace cie::analysis
