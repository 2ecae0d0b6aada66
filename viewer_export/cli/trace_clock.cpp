#include "trace_clock.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>

namespace cie::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kPacketMagic = 0x75D11D57;
constexpr std::size_t kHeaderBytes = 37;    // of a metadata packet, CTF 1.8 section 7.1
constexpr std::size_t kContentBitsAt = 24;  // after magic, uuid and checksum
constexpr std::size_t kPacketBitsAt = 28;
constexpr std::size_t kMostMetadata = 1U << 24U;
constexpr std::size_t kMostFiles = 4096;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

std::uint32_t read_u32(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

bool is_name(char c) {
  return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

// The integer of "name = 123;" in a block; empty when absent.
std::optional<std::int64_t> attribute(std::string_view block, std::string_view name) {
  for (auto at = block.find(name); at != std::string_view::npos; at = block.find(name, at + 1)) {
    const bool is_start = at == 0 || !is_name(block[at - 1]);
    const auto equals = block.find_first_not_of(" \t", at + name.size());
    if (!is_start || equals == std::string_view::npos || block[equals] != '=') {
      continue;
    }
    const auto digits = block.find_first_not_of(" \t", equals + 1);
    std::int64_t value = 0;
    if (digits != std::string_view::npos &&
        std::from_chars(block.data() + digits, block.data() + block.size(), value).ec ==
            std::errc{}) {
      return value;
    }
  }
  return std::nullopt;
}

// Every file named "metadata" below, in order of path.
std::set<fs::path> metadata_files(const std::vector<fs::path>& traces) {
  std::set<fs::path> files;
  for (const auto& trace : traces) {
    std::error_code error;
    fs::recursive_directory_iterator at(trace, fs::directory_options::skip_permission_denied,
                                        error);
    for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
      if (at->path().filename() == "metadata" && files.size() < kMostFiles) {
        files.insert(at->path());
      }
    }
  }
  return files;
}

std::string read_file(const fs::path& file) {
  std::error_code error;
  const auto size = fs::file_size(file, error);  // fails for anything but a regular file
  if (error || size > kMostMetadata) {
    return {};
  }
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

}  // namespace

std::string metadata_text(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes || read_u32(bytes, 0) != kPacketMagic) {
    return std::string(bytes);  // plain text, or of the other byte order
  }
  std::string text;
  while (bytes.size() >= kHeaderBytes && read_u32(bytes, 0) == kPacketMagic) {
    const std::size_t content = read_u32(bytes, kContentBitsAt) / 8;
    const std::size_t packet = read_u32(bytes, kPacketBitsAt) / 8;
    if (content < kHeaderBytes || packet < content || packet > bytes.size()) {
      break;
    }
    text += bytes.substr(kHeaderBytes, content - kHeaderBytes);
    bytes.remove_prefix(packet);
  }
  return text;
}

std::optional<std::int64_t> clock_offset_ns(std::string_view metadata) {
  constexpr std::string_view kClock = "\nclock {";
  const auto begin = metadata.find(kClock);
  if (begin == std::string_view::npos) {
    return std::nullopt;
  }
  const auto block = metadata.substr(begin, metadata.find('}', begin) - begin);
  if (attribute(block, "freq").value_or(kNsPerSecond) != kNsPerSecond) {
    return std::nullopt;
  }
  std::int64_t offset = 0;
  if (__builtin_mul_overflow(attribute(block, "offset_s").value_or(0), kNsPerSecond, &offset) ||
      __builtin_add_overflow(offset, attribute(block, "offset").value_or(0), &offset)) {
    return std::nullopt;
  }
  return offset;
}

std::optional<std::int64_t> find_clock_offset(const std::vector<fs::path>& traces) {
  std::optional<std::int64_t> result;
  for (const auto& file : metadata_files(traces)) {
    const auto offset = clock_offset_ns(metadata_text(read_file(file)));
    std::int64_t difference = 0;
    if (offset && result &&
        (__builtin_sub_overflow(*offset, *result, &difference) || difference > kNsPerSecond ||
         difference < -kNsPerSecond)) {
      return std::nullopt;
    }
    result = result ? result : offset;
  }
  return result;
}

}  // namespace cie::cli
