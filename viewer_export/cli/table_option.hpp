// Names of table formats on the command line.
#pragma once

#include <cie/viewer_export/table_format.hpp>

#include <string>
#include <string_view>

namespace cie::cli {

// "csv", "jsonl" or "parquet" as the value of `option`. Throws UsageError.
viewer_export::TableFormat table_format_of(std::string_view option, const std::string& name);

}  // namespace cie::cli
