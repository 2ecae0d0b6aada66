// Whether a shared object is really gone after it was closed, and if not, why.
#pragma once

#include <string>

namespace cie::container {

// Empty if no object of this name is mapped any more; else the likely cause and the remedy.
std::string why_still_mapped(const std::string& library);

}  // namespace cie::container
