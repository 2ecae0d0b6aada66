#include "stream_ends.hpp"

#include "recorded_parts.hpp"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>

namespace cie::analysis {
namespace {

// As LTTng names the directories of a rotated session's chunks: "20261129T042623+0000-20261129T042624+0000-3".
bool is_chunk_of_lttng(std::string_view name) {
  constexpr std::string_view kTimes = "00000000T000000+0000-00000000T000000+0000-";
  if (name.size() <= kTimes.size()) return false;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_like = [&is_digit](char c, char like) {
    return like == '0' ? is_digit(c) : c == like || (like == '+' && c == '-');
  };
  return std::ranges::equal(name.substr(0, kTimes.size()), kTimes, is_like) &&
         std::ranges::all_of(name.substr(kTimes.size()), is_digit);
}

bool is_of_sound_chunk(std::span<const Recording> recordings, const std::string& file) {
  bool is_of_chunk = false;
  for (const auto* recording : recordings_around(recordings, file)) {
    if (!recording->manifest) continue;
    if (!all_problems(*recording->manifest).empty()) return false;
    is_of_chunk = is_of_chunk || recording->manifest->chunk;
  }
  if (is_of_chunk) return true;
  std::error_code error;
  const auto path = std::filesystem::absolute(file, error);
  return std::ranges::any_of(
      path, [](const std::filesystem::path& part) { return is_chunk_of_lttng(part.native()); });
}

}  // namespace

bool ends_with_last_packet(std::span<const Recording> recordings, PacketWriter writer,
                           const std::string& path) {
  return writer == PacketWriter::copier || is_of_sound_chunk(recordings, path);
}

}  // namespace cie::analysis
