// Writing to open files, and what is thrown where that fails.
#pragma once

#include <string>
#include <string_view>

namespace cie::viewer_export {

// Throws WriteError: "<what>: <text of error>".
[[noreturn]] void throw_write_error(const std::string& what, int error);

// Writes everything or throws WriteError naming `object`.
void write_all(int descriptor, std::string_view bytes, const std::string& object);

}  // namespace cie::viewer_export
