// The rows of every table of a report.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "table.hpp"

#include <functional>
#include <string>
#include <vector>

namespace cie::viewer_export {

struct ResultTable {
  std::string name;
  std::vector<Column> columns;
  // Calls back with each row, in the report's order.
  std::function<void(const analysis::Report&, const analysis::VerdictReport&,
                     const std::function<void(std::span<const Cell>)>&)>
      rows;
};

// The callbacks first.
const std::vector<ResultTable>& result_tables();

}  // namespace cie::viewer_export
