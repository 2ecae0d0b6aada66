// Metadata from its text, of CTF 1.8 (TSDL) or 2 (JSON).
#pragma once

#include "tokens.hpp"
#include "types.hpp"

#include <functional>
#include <string>
#include <string_view>

namespace cie::analysis::ctf {

// Throws MetadataError. The fields of event classes whose names `is_wanted` refuses may be left
// unread: a kernel declares a thousand classes, of which few have events.
Metadata parse_metadata(std::string text,
                        const std::function<bool(std::string_view)>& is_wanted = {});

}  // namespace cie::analysis::ctf
