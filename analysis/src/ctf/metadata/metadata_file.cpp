#include "metadata_file.hpp"

#include "file.hpp"
#include "tokens.hpp"
#include "types.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace cie::analysis::ctf {
namespace {

constexpr std::size_t kHeaderBytes = 37;  // CTF 1.8, 7.1
constexpr std::size_t kContentBitsAt = 24;
constexpr std::size_t kPacketBitsAt = 28;
constexpr std::size_t kCompressionAt = 32;
constexpr std::size_t kEncryptionAt = 33;
constexpr std::uint64_t kMaxBytes = 64U << 20U;

std::uint32_t read_u32(std::string_view bytes, std::size_t at, bool is_swapped) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return is_swapped ? __builtin_bswap32(value) : value;
}

bool is_packet(std::string_view bytes, bool is_swapped) {
  return bytes.size() >= sizeof kMetadataMagic && read_u32(bytes, 0, is_swapped) == kMetadataMagic;
}

}  // namespace

bool is_text_sequence(std::string_view bytes) noexcept {
  const auto first = bytes.find_first_not_of(kBlank);
  return first != std::string_view::npos && bytes[first] == '\x1e';
}

std::string metadata_text(std::string file) {
  const std::string_view bytes = file;
  const bool is_swapped = is_packet(bytes, true);
  if (!is_swapped && !is_packet(bytes, false)) {
    const auto first = bytes.find_first_not_of(kBlank);
    if (first != std::string_view::npos && (bytes[first] == '[' || bytes[first] == '{')) {
      throw MetadataError("it is JSON, but no text sequence as CTF 2 has it (RFC 7464)");
    }
    return file;
  }
  std::size_t size = 0;  // of the text, which takes the place of packets that were read
  for (auto rest = bytes; !rest.empty();) {
    const auto at = std::to_string(bytes.size() - rest.size());
    // Too little for a packet, and not the begin of one: a line feed that an editor or a transfer
    // has added.
    if (size > 0 && rest.size() < kHeaderBytes && !is_packet(rest, is_swapped)) break;
    if (rest.size() < kHeaderBytes) throw MetadataError("it is cut at byte " + at);
    if (!is_packet(rest, is_swapped)) throw MetadataError("it is damaged at byte " + at);
    const std::size_t content = read_u32(rest, kContentBitsAt, is_swapped) / 8;
    const std::size_t packet = read_u32(rest, kPacketBitsAt, is_swapped) / 8;
    if (content < kHeaderBytes || packet < content) {
      throw MetadataError("it is damaged at byte " + at);
    }
    if (content > rest.size()) throw MetadataError("it is cut at byte " + at);
    if (rest[kCompressionAt] != 0 || rest[kEncryptionAt] != 0) {
      throw MetadataError("it is compressed or encrypted");
    }
    std::memmove(file.data() + size, rest.data() + kHeaderBytes, content - kHeaderBytes);
    size += content - kHeaderBytes;
    rest.remove_prefix(std::min(packet, rest.size()));
  }
  file.resize(size);
  if (is_text_sequence(file)) throw MetadataError("it is of CTF 2, which has no packets here");
  return file;
}

std::string read_metadata(const std::filesystem::path& path) {
  const File file(path.string());
  if (!file.is_readable()) throw MetadataError("it cannot be read: " + file.error());
  if (file.size() == 0) {
    throw MetadataError(
        "it is empty: the recording has just begun (read it again later), or the tracer ended "
        "before it wrote what the trace holds");
  }
  if (file.size() > kMaxBytes) throw MetadataError("it is larger than 64 MiB");
  std::string bytes(file.size(), '\0');
  bytes.resize(file.read(0, {reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size()}));
  return bytes;
}

}  // namespace cie::analysis::ctf
