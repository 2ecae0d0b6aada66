#include "callback_questions.hpp"

#include <algorithm>

namespace cie::analysis {

std::uint64_t known_instances(const Model& model, const CallbackFacts& callback) {
  const bool is_attached =
      model.processes[at(callback.process)].first_moment == RunMoment::announce;
  const auto& starts = callback.starts;
  // Those that numbers show to be missing may be some of those outside.
  auto count = starts.count + std::max(callback.starts_outside, starts.missing);
  count = std::max(count, callback.started_in_all);
  if (callback.fini) count = std::max(count, callback.fini->started);
  if (is_attached && callback.registered) count = std::max(count, callback.first_next_seq);
  if (callback.ended.last) count = std::max<std::uint64_t>(count, 1);
  return count;
}

EventRef first_sign(const Model& model, const CallbackFacts& callback) noexcept {
  if (callback.registered) return *callback.registered;
  if (callback.starts.first) return callback.starts.first_at;
  if (callback.ended.last) return callback.ended.last_at;
  if (callback.fini) return callback.fini->at;
  if (callback.overwritten_at) return *callback.overwritten_at;
  if (callback.lost_at) return *callback.lost_at;
  return model.processes[at(callback.process)].first_seen.value_or(EventRef{});
}

bool may_be_told_by_own(const Model& model, const CallbackFacts& callback) noexcept {
  const auto& process = model.processes[at(callback.process)];
  if (callback.is_accounted || process.is_from_ros2) return false;
  return !process.run_begin || process.first_moment != RunMoment::start;
}

bool is_there_for_certain(const Model& model, const CallbackOnThread& pair) noexcept {
  const auto& callback = model.callbacks[at(pair.callback)];
  return pair.is_certain && !callback.is_after_rcl_init && !may_be_told_by_own(model, callback);
}

bool is_certainly_another(const Model& model, const CallbackOnThread& pair) noexcept {
  const bool is_one = pair.is_of_several || is_of_its_own(model.callbacks[at(pair.callback)]);
  return is_one && is_there_for_certain(model, pair);
}

bool is_identified(const CallbackFacts& callback) noexcept {
  return callback.registered && callback.is_identified && !callback.may_be_another;
}

std::string_view why_unidentified(const CallbackFacts& callback) noexcept {
  if (!callback.registered) return "its registration was not seen";
  if (!callback.is_identified) return "registered in part only";
  if (callback.is_after_rcl_init) {
    return "made after another rcl_init of this pid, perhaps by another process than the one of "
           "its id before";
  }
  return callback.is_beside_partly_known
             ? "beside a callback of its kind that is registered in part only, and may be of its id"
             : "registered after events were lost, perhaps those of another of its id";
}

EventRef last_sign(const CallbackFacts& callback) {
  EventRef last = *callback.registered;
  const auto consider = [&last](const EventRef& sign) {
    if (sign.time > last.time) last = sign;
  };
  if (callback.starts.last) consider(callback.starts.last_at);
  if (callback.ended.last) consider(callback.ended.last_at);
  if (callback.fini) consider(callback.fini->at);
  return last;
}

std::optional<Timestamp> end_of_window(const Model& model, StreamIndex stream) {
  if (at(stream) >= model.streams.size()) return std::nullopt;
  const auto channel = model.channels.find(model.streams[at(stream)].channel);
  return channel != model.channels.end() ? channel->second.end : std::nullopt;
}

}  // namespace cie::analysis
