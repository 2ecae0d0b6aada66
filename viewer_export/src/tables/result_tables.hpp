// The rows of every table of a report.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "table.hpp"

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

struct ResultTable {
  // The process that a row is about; empty: the recording as a whole.
  using Consume = std::function<void(std::span<const Cell>, std::optional<analysis::ProcessIndex>)>;

  std::string name;
  std::vector<Column> columns;
  // Calls back with each row, in the report's order.
  std::function<void(const analysis::Report&, const analysis::VerdictReport&, const Consume&)> rows;
};

// Of callbacks: the names that columns of their summaries begin with.
const std::vector<std::string_view>& callback_quantities();

// The callbacks first.
const std::vector<ResultTable>& result_tables();

}  // namespace cie::viewer_export
