// The fixed parts of HTML pages, as they stand in the folder html.
#pragma once

#include <string_view>

namespace cie::viewer_export {

extern const std::string_view kReportCss;
extern const std::string_view kReportJs;
extern const std::string_view kLiveHtml;  // of cie live --listen; its style follows the report's
extern const std::string_view kLiveCss;
extern const std::string_view kLiveJs;

}  // namespace cie::viewer_export
