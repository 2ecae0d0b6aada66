// What a thread has taken and not handled yet: most often a message that its next callback is given,
// but several may be taken (rclcpp::WaitSet) before the first one is handled.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace cie::analysis::ros2 {

// The latest message of each receiver. Receiver{}: it was not told whose; whoever starts next is given that.
template <typename Receiver, typename Message>
class TakenMessages {
 public:
  void add(Receiver receiver, Message message) {
    if (!taken_.empty()) remove(receiver);
    if (taken_.size() >= kMost) taken_.erase(taken_.begin());
    taken_.push_back({receiver, std::move(message)});
  }
  // What its receiver, who starts, was given. One that is unknown was given what was taken last.
  std::optional<Message> give(Receiver receiver) {
    std::optional<Message> given;
    for (auto i = taken_.size(); i-- > 0 && !given;) {
      auto& [of, message] = taken_[i];
      const bool is_its = of == receiver || of == Receiver{} || receiver == Receiver{};
      if (is_its) given = std::move(message);
    }
    if (receiver == Receiver{}) clear();
    if (!taken_.empty()) remove(receiver);
    return given;
  }
  // Somebody started: what is of nobody that was told was theirs.
  void start() {
    if (!taken_.empty()) remove(Receiver{});
  }
  void clear() noexcept { taken_.clear(); }
  bool is_empty() const noexcept { return taken_.empty(); }

 private:
  struct Entry {
    Receiver of;
    Message message;
  };
  static constexpr std::size_t kMost = 64;

  void remove(Receiver receiver) {
    std::erase_if(taken_, [receiver](const Entry& entry) { return entry.of == receiver; });
  }

  std::vector<Entry> taken_;  // the latest last
};

}  // namespace cie::analysis::ros2
