// How many messages a queue overwrote, where not only messages announce themselves.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cie_rclcpp {

// The middleware announces the end of the last writer as it does a message, and that takes no place in
// the queue. Who was heard before and after has not ended between: what announcements say was
// overwritten in that time was. Of the rest one is left out for each message that was taken, for one
// writer's end. Two kinds of queue also hold what is for others (answers to other clients, messages that
// come through the process as well): of theirs only what is certain counts, and nothing once such a one
// was met. So the count is late, or lacks some, and is never too high.
class OverwrittenCount {
 public:
  OverwrittenCount(std::size_t depth, bool is_shared) : depth_(depth), is_shared_(is_shared) {
    writers_.reserve(kMostWriters);
    heard_before_.reserve(kMostWriters);
    heard_by_mark_.reserve(kMostWriters);
  }

  // One taker at a time. One of `writer` was taken, when `announced` had been overwritten by announcements.
  void on_taken(std::uint64_t writer, std::uint64_t announced) {
    const bool is_marked = before_ > 0;
    if (is_marked && --before_ == 0) {
      settle(std::ranges::find(heard_before_, writer) != heard_before_.end());
    }
    if (before_ == 0 && announced > known()) {
      marked_.store(announced);
      before_ = std::max<std::size_t>(depth_, 1);
      heard_before_ = is_marked ? heard_by_mark_ : writers_;
      hear(writer);
      heard_by_mark_ = writers_;
      return;
    }
    hear(writer);
  }
  // There was none: what comes next was not there before.
  void on_empty() noexcept {
    if (before_ > 0) before_ = 1;
  }
  // One was taken that is for others.
  void on_other() noexcept {
    if (is_shared_) meets_others_ = true;
  }

  // From any thread.
  std::uint64_t count(std::uint64_t announced) const noexcept {
    const std::uint64_t settled = settled_.load();
    if (is_shared_) return settled;
    const std::uint64_t marked = marked_.load();
    return settled + but_one(marked, settled + doubted_.load()) + but_one(announced, marked);
  }

 private:
  static constexpr std::size_t kMostWriters = 16;

  std::uint64_t known() const noexcept { return settled_.load() + doubted_.load(); }
  static std::uint64_t but_one(std::uint64_t until, std::uint64_t from) noexcept {
    return until > from ? until - from - 1 : 0;
  }
  void settle(bool is_heard_again) noexcept {
    const std::uint64_t open = marked_.load() - known();
    const std::uint64_t doubted = meets_others_ ? open : (is_heard_again ? 0 : 1);
    doubted_.fetch_add(doubted);  // first, so that no count between is too high
    settled_.fetch_add(open - doubted);
  }
  void hear(std::uint64_t writer) {
    if (std::ranges::find(writers_, writer) != writers_.end()) return;
    if (writers_.size() == kMostWriters) writers_.erase(writers_.begin());
    writers_.push_back(writer);
  }

  const std::size_t depth_;
  const bool is_shared_;
  bool meets_others_ = false;
  std::vector<std::uint64_t> writers_;  // the latest
  // What was overwritten until the mark is decided by the first message that came later.
  std::size_t before_ = 0;                   // so many more are taken; 0: no mark
  std::vector<std::uint64_t> heard_before_;  // any of it was overwritten
  std::vector<std::uint64_t> heard_by_mark_;
  std::atomic<std::uint64_t> marked_{0};  // announced until then
  std::atomic<std::uint64_t> settled_{0};
  std::atomic<std::uint64_t> doubted_{0};
};

}  // namespace cie_rclcpp
