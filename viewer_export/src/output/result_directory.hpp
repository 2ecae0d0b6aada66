// Directories of results that are several files.
#pragma once

#include <filesystem>

namespace cie::viewer_export {

// Makes it, and those above it, unless they are there. Throws WriteError, also if it is another
// user's, or everybody may write to it: they could put links in the way of its files.
void make_result_directory(const std::filesystem::path& directory);

}  // namespace cie::viewer_export
