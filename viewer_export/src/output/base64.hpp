// Bytes as text (RFC 4648), and their digest as content security policies want it.
#pragma once

#include <string>
#include <string_view>

namespace cie::viewer_export {

std::string base64(std::string_view bytes);

// "sha256-…" of a script or style between its tags (CSP level 2).
std::string csp_hash(std::string_view text);

}  // namespace cie::viewer_export
