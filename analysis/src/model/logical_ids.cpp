#include "logical_ids.hpp"

#include <cie/tracepoints/logical_id.hpp>

namespace cie::analysis {

IdParts::IdParts(std::string_view id) {
  const auto plain = LogicalId::without_number(id);
  node = LogicalId::node_of(plain);
  kind_and_what = plain.substr(node.size());
}

}  // namespace cie::analysis
