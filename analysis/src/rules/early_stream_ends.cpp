#include "early_stream_ends.hpp"

#include "model/stream_ends.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace cie::analysis {
namespace {

// LTTng was seen to end the streams of twelve CPUs within 0.1 ms, those of a snapshot within 1 ms.
constexpr Duration kTogether{10'000'000};

}  // namespace

EarlyStreamEnds::EarlyStreamEnds(const Model& model) {
  std::map<std::uint32_t, std::vector<const StreamFacts*>> traces;
  for (const auto& stream : model.streams) {
    // LTTng flushes the buffer of an idle CPU once, in the middle of a run: that ends nothing.
    const bool is_flush_alone = stream.events == 0 && stream.begin == stream.end;
    const bool is_ended = stream.has_ended && stream.end && stream.is_evidence && !is_flush_alone;
    if (is_ended && stream.domain == Domain::user) traces[stream.trace].push_back(&stream);
  }
  for (const auto& [trace, streams] : traces) {
    const auto& any = *streams.front();
    if (ends_with_last_packet(model.recordings, any.writer, any.path)) continue;
    const auto [first, last] =
        std::ranges::minmax(streams, {}, [](const StreamFacts* stream) { return *stream->end; });
    const auto is_early = [latest = *last->end](const StreamFacts* stream) {
      return latest - *stream->end > kTogether;
    };
    const auto early = static_cast<std::size_t>(std::ranges::count_if(streams, is_early));
    // Where no tracer wrote them, each ends at its own last event.
    const bool end_as_one = any.writer == PacketWriter::lttng ||
                            (streams.size() - early >= 2 && 2 * early <= streams.size());
    if (early > 0 && end_as_one) first_.emplace(trace, first);
  }
}

const StreamFacts* EarlyStreamEnds::of(const ProcessFacts& process) const {
  const StreamFacts* first = nullptr;
  for (const auto trace : process.traces) {
    const auto found = first_.find(trace);
    if (found == first_.end()) continue;
    if (first == nullptr || *found->second->end < *first->end) first = found->second;
  }
  return first;
}

}  // namespace cie::analysis
