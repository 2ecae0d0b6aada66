// The version of this build, as reports and `cie --version` print it.
#pragma once

#include <string_view>

namespace cie::viewer_export {

// "1.2.3". Points to static storage.
std::string_view tool_version() noexcept;

}  // namespace cie::viewer_export
