// Metadata of CTF 2 from its fragments.
#pragma once

#include "types.hpp"

#include <string_view>

namespace cie::analysis::ctf {

// Of a JSON text sequence (see fragment_json.hpp). Throws MetadataError, which names the fragment.
Metadata parse_fragments(std::string_view sequence);

}  // namespace cie::analysis::ctf
