// The text of a trace's metadata file, which may come in packets.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace cie::analysis::ctf {

// Whether the bytes are the metadata of CTF 2: a text sequence (RFC 7464) begins with its
// separator.
bool is_text_sequence(std::string_view bytes) noexcept;

// Of a file's bytes. Throws MetadataError if packets are cut or damaged, or the metadata is of
// another format.
std::string metadata_text(std::string file);

// The bytes of a file. Throws MetadataError when it cannot be read, is empty or is too large.
std::string read_metadata(const std::filesystem::path& file);

}  // namespace cie::analysis::ctf
