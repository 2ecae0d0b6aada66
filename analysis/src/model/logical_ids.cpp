#include "logical_ids.hpp"

#include <cie/tracepoints/logical_id.hpp>

#include <charconv>
#include <limits>
#include <system_error>

namespace cie::analysis {

IdParts::IdParts(std::string_view id) {
  const auto plain = LogicalId::without_number(id);
  node = LogicalId::node_of(plain);
  kind_and_what = plain.substr(node.size());
}

std::uint32_t id_number(std::string_view id) noexcept {
  const auto plain = LogicalId::without_number(id);
  if (plain.size() == id.size()) return 1;
  std::uint32_t number = 0;
  const auto digits = id.substr(plain.size() + 1);
  const auto parsed = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return parsed.ec == std::errc{} ? number : std::numeric_limits<std::uint32_t>::max();
}

}  // namespace cie::analysis
