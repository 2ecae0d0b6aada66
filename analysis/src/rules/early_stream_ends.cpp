#include "early_stream_ends.hpp"

#include "model/recorded_parts.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

namespace cie::analysis {
namespace {

// LTTng was seen to end the streams of twelve CPUs within 0.1 ms, those of a snapshot within 1 ms.
constexpr Duration kTogether{10'000'000};

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

// A chunk's streams end with what they held when LTTng rotated: of a CPU that was quiet, early. Where its recorder
// had a problem, they may end early as all others do.
bool is_of_sound_chunk(const Model& model, const StreamFacts& stream) {
  bool is_of_chunk = false;
  for (const auto* recording : recordings_around(model, stream.path)) {
    if (!recording->manifest) continue;
    if (!recording->manifest->problems.empty()) return false;
    is_of_chunk = is_of_chunk || recording->manifest->chunk;
  }
  if (is_of_chunk) return true;
  std::error_code error;
  const auto path = std::filesystem::absolute(stream.path, error);
  return std::ranges::any_of(
      path, [](const std::filesystem::path& part) { return is_chunk_of_lttng(part.native()); });
}

}  // namespace

EarlyStreamEnds::EarlyStreamEnds(const Model& model) : model_(model) {
  std::map<std::uint32_t, std::vector<const StreamFacts*>> traces;
  for (const auto& stream : model.streams) {
    const bool is_ended = stream.has_ended && stream.end && stream.is_evidence;
    if (is_ended && stream.domain == Domain::user) traces[stream.trace].push_back(&stream);
  }
  for (const auto& [trace, streams] : traces) {
    if (is_of_sound_chunk(model, *streams.front())) continue;
    const auto [first, last] =
        std::ranges::minmax(streams, {}, [](const StreamFacts* stream) { return *stream->end; });
    const auto is_early = [latest = *last->end](const StreamFacts* stream) {
      return latest - *stream->end > kTogether;
    };
    const auto early = static_cast<std::size_t>(std::ranges::count_if(streams, is_early));
    // Where no tracer wrote them, each ends at its own last event.
    const bool end_as_one = streams.size() - early >= 2 && 2 * early <= streams.size();
    if (early > 0 && end_as_one) first_.emplace(trace, first);
  }
}

const StreamFacts* EarlyStreamEnds::of(const ProcessFacts& process) const {
  if (!process.first_seen) return nullptr;
  const auto* stream = find_stream(model_, process.first_seen->stream);
  const auto found = stream == nullptr ? first_.end() : first_.find(stream->trace);
  return found == first_.end() ? nullptr : found->second;
}

}  // namespace cie::analysis
