// Metadata from its text, of CTF 1.8 (TSDL) or 2 (JSON).
#pragma once

#include "tokens.hpp"
#include "types.hpp"

#include <string_view>

namespace cie::analysis::ctf {

// Throws MetadataError.
Metadata parse_metadata(std::string_view text);

}  // namespace cie::analysis::ctf
