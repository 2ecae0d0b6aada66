// Metadata of a recording by `cie record` that has lost its own: what its provider's schema and its
// streams say it was.
#pragma once

#include <filesystem>
#include <string>

namespace cie::analysis::ctf {

// Whether files of a directory without metadata are those that `cie record` writes.
bool looks_recorded(const std::filesystem::path& directory);

// Whether a file of the directory begins like a packet of CTF, whoever recorded it.
bool has_packets(const std::filesystem::path& directory);

// Text of the metadata of the trace in a directory. Throws MetadataError where its streams are not
// those of `cie record`, or leave open what their events are.
std::string rebuild_metadata(const std::filesystem::path& directory);

}  // namespace cie::analysis::ctf
