// What a user has to know although no function of his can be told by returning.
#pragma once

#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace cie::executor {

// Thread-safe.
class Warnings {
 public:
  using Handler = std::function<void(const std::string&)>;

  // Empty: stderr.
  explicit Warnings(Handler handler) : handler_(std::move(handler)) {}

  // The same text only once. What the handler throws is dropped.
  void tell(const std::string& text) noexcept;

 private:
  Handler handler_;
  std::mutex mutex_;  // of what follows, and while the handler runs
  std::set<std::string> told_;
};

}  // namespace cie::executor
