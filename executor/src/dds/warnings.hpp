// What a user has to know although no function of his can be told by returning.
#pragma once

#include <cie/tracepoints/priority_mutex.hpp>

#include <functional>
#include <set>
#include <string>
#include <utility>

namespace cie::executor {

// Thread-safe. DDS's receive thread warns, too: it waits for nobody's handler.
class Warnings {
 public:
  using Handler = std::function<void(const std::string&)>;

  // Empty: stderr.
  explicit Warnings(Handler handler) : handler_(std::move(handler)) {}

  // The same text only once. Several threads may be in the handler at once. What it throws is dropped.
  void tell(const std::string& text) noexcept;

 private:
  Handler handler_;
  PriorityMutex mutex_;  // of what follows
  std::set<std::string> told_;
};

}  // namespace cie::executor
