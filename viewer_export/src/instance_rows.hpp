// The rows that an InstanceWriter collected, for any table.
#pragma once

#include <cie/viewer_export/instance_writer.hpp>

#include "table.hpp"

#include <span>

namespace cie::viewer_export {

class InstanceRows {
 public:
  static std::span<const Column> columns();
  // Gives all rows to `table`, in the contract's order; there are none afterwards. Throws
  // WriteError, and what the table throws.
  static void drain(InstanceWriter& instances, TableWriter& table);
};

}  // namespace cie::viewer_export
