// Tells when a callback of a traced process missed its deadline.
#pragma once

#include "lttng/event_watch.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace cie::record {

struct DeadlineMiss {
  std::uint64_t callback_id = 0;
  std::uint64_t response_ns = 0;
  std::uint64_t deadline_ns = 0;
};

class DeadlineWatch {
 public:
  // Throws RecordError when LTTng refuses.
  explicit DeadlineWatch(const std::string& name);

  // Takes what came since the last call; the first of it. Never waits.
  std::optional<DeadlineMiss> poll();

 private:
  EventWatch misses_;
};

}  // namespace cie::record
