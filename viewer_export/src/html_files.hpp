// The fixed parts of HTML pages, as they stand in the folder html.
#pragma once

#include <string_view>

namespace cie::viewer_export {

extern const std::string_view kReportCss;
extern const std::string_view kReportJs;

}  // namespace cie::viewer_export
