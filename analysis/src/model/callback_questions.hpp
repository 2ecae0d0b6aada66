// What follows from the facts about a callback.
#pragma once

#include <cie/analysis/time.hpp>

#include "facts.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>

namespace cie::analysis {

// Instances of the callback that are known to have run, seen or counted.
std::uint64_t known_instances(const Model& model, const CallbackFacts& callback);

// Those of them that are recorded and not in the window, where nobody asked for another one.
inline std::uint64_t left_out_instances(const CallbackFacts& callback) {
  return callback.starts_left_out + (callback.outside ? callback.outside->count : 0);
}

// The first event seen that names the callback, or the first one of its process.
EventRef first_sign(const Model& model, const CallbackFacts& callback) noexcept;

// No other callback of the process may be the same one: of ROS 2, what was never registered is known
// by an address alone, of which a callback has several.
inline bool is_of_its_own(const CallbackFacts& callback) {
  return callback.registered || callback.is_accounted;
}

// Totals prove that one of its instances did not end.
inline bool has_unended(const CallbackFacts& callback) {
  return callback.fini && callback.fini->ended < callback.fini->started;
}

// Calls `visit` with each of its instances that did not end, or has not yet.
void for_each_open(const CallbackFacts& callback, const auto& visit) {
  std::ranges::for_each(callback.open, visit);
  std::ranges::for_each(callback.running, visit);
}

// It was released by then: when it was, if that is known, else when it started.
inline Timestamp latest_release(const OpenInstance& open) {
  return open.release && open.release_exact ? *open.release : open.start.time;
}

// ROS 2's events alone tell of it, from before anything was seen of what its process has of its own:
// no run_begin shows that these had not begun. They may tell of it by an id of theirs, or leave it out
// as rclcpp's.
bool may_be_told_by_own(const Model& model, const CallbackFacts& callback) noexcept;

// No other callback of the process, nor another process of its pid, may have run there in its place.
bool is_there_for_certain(const Model& model, const CallbackOnThread& pair) noexcept;

// It was there for certain, and is no other one's second address: it was registered, or see
// note_addresses_in_turn().
bool is_certainly_another(const Model& model, const CallbackOnThread& pair) noexcept;

// Its registration told an id, be it in part, as those of ROS 2 may.
inline bool has_logical_id(const CallbackFacts& callback) noexcept {
  return callback.registered && (callback.is_identified || !callback.is_accounted);
}

// Its logical id is known, and so are its kind, its deadline and its entry in the spec.
bool is_identified(const CallbackFacts& callback) noexcept;
// "its registration was not seen", or what else is why it is not.
std::string_view why_unidentified(const CallbackFacts& callback) noexcept;

// Of a registered one the last: its fini, an end, a start, its registration.
EventRef last_sign(const CallbackFacts& callback);

// Of the channel that the stream belongs to, by its host's clock.
std::optional<Timestamp> end_of_window(const Model& model, StreamIndex stream);

}  // namespace cie::analysis
