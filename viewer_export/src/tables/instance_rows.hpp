// The rows that an InstanceWriter collected, for any table.
#pragma once

#include <cie/viewer_export/instance_writer.hpp>

#include "table.hpp"

#include <functional>
#include <span>

namespace cie::viewer_export {

class InstanceRows {
 public:
  static std::span<const Column> columns();
  // Gives all rows to `table`, in the contract's order; there are none afterwards. `report` has the
  // processes. Throws WriteError, and what the table throws.
  static void drain(InstanceWriter& instances, TableWriter& table, const analysis::Report& report);
  // The same with the process of each row, and whether the report counts it: an edge of the window
  // or a loss does not cut it, and it has an end.
  using Consume =
      std::function<void(std::span<const Cell>, analysis::ProcessIndex, bool is_counted)>;
  static void drain(InstanceWriter& instances, const analysis::Report& report,
                    const Consume& consume);
};

}  // namespace cie::viewer_export
