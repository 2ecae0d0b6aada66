// Which instances of a long recording a picture of bounded size shows.
#pragma once

#include <cie/analysis/instance.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace cie::viewer_export {

// An instance without its names.
struct TimelineInstance {
  std::int64_t start = 0;  // ns
  std::optional<std::int64_t> release{};
  std::optional<std::int64_t> end{};  // empty: open
  std::optional<std::int64_t> execution{};
  std::optional<std::int64_t> preempted{};
  std::optional<std::int64_t> blocked{};
  std::optional<std::int64_t> wake_delay{};
  std::int64_t tid = 0;
  std::uint64_t seq = 0;
  std::uint32_t missed = 0;
  bool is_release_exact = false;

  // From release to end; empty unless both are known exactly.
  std::optional<std::int64_t> response() const;
};

// Keeps at most about `limit` instances of all callbacks: an even choice, thinned as more come, and
// always the slowest of each callback and those that never ended or missed releases (some hundreds
// of each). What is kept depends on the instances and their order only.
class TimelineChoice {
 public:
  explicit TimelineChoice(std::size_t limit) : limit_(limit) {}

  void add(std::size_t callback, const TimelineInstance& instance);

  struct Kept {
    std::vector<TimelineInstance> instances;  // by start
    std::uint64_t of = 0;                     // how many there were
  };
  // Of every callback that had an instance, by its number.
  std::vector<Kept> take();

 private:
  struct Lane {
    std::vector<TimelineInstance> evenly;
    std::vector<std::uint64_t> numbers;     // of `evenly`: each a multiple of `stride`
    std::vector<TimelineInstance> slowest;  // a heap, the least slow first
    std::vector<TimelineInstance> remarkable;
    std::uint64_t stride = 1;
    std::uint64_t seen = 0;
  };

  void thin_out();

  std::size_t limit_;
  std::size_t kept_evenly_ = 0;
  std::vector<Lane> lanes_;
};

}  // namespace cie::viewer_export
