// Files of viewer_export/clickhouse, in the library.
#pragma once

#include <string_view>

namespace cie::viewer_export {

extern const std::string_view kClickHouseLoader;  // load.sh with places for a recording

}  // namespace cie::viewer_export
