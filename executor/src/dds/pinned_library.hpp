// Keeps code loaded.
#pragma once

#include <memory>

namespace cie::executor {

// The shared object that contains `code` stays loaded as long as a copy of the result lives. Null
// for code of the program itself.
std::shared_ptr<void> pin_library_of(const void* code);

}  // namespace cie::executor
