#include "callback_questions.hpp"

#include <algorithm>

namespace cie::analysis {

std::uint64_t known_instances(const Model& model, const CallbackFacts& callback) {
  const bool is_attached =
      model.processes[at(callback.process)].first_moment == RunMoment::announce;
  auto count = std::max(callback.starts.count + callback.starts_outside, callback.started_in_all);
  if (callback.fini) count = std::max(count, callback.fini->started);
  if (is_attached && callback.registered) count = std::max(count, callback.first_next_seq);
  return count;
}

std::optional<Timestamp> end_of_window(const Model& model, StreamIndex stream) {
  if (at(stream) >= model.streams.size()) return std::nullopt;
  const auto channel = model.channels.find(model.streams[at(stream)].channel);
  return channel != model.channels.end() ? channel->second.end : std::nullopt;
}

}  // namespace cie::analysis
