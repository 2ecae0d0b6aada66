// Comma-separated values as RFC 4180 has them, with "\n" between rows.
#pragma once

#include <string>
#include <string_view>

namespace cie::viewer_export {

// Quoted when it holds a comma, a quote or a line break. Invalid UTF-8 becomes U+FFFD.
std::string csv_field(std::string_view text);

}  // namespace cie::viewer_export
