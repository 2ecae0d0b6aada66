#include "lttng/deadline_watch.hpp"

namespace cie::record {

DeadlineWatch::DeadlineWatch(const std::string& name)
    : misses_(name, "cie:deadline_miss",
              {{.name = "callback_id"}, {.name = "response_ns"}, {.name = "deadline_ns"}},
              "watch for missed deadlines") {}

std::optional<DeadlineMiss> DeadlineWatch::poll() {
  std::optional<DeadlineMiss> first;
  while (const auto event = misses_.poll()) {
    const auto number = [&event](std::size_t index) {
      return static_cast<std::uint64_t>(number_of((*event)[index]));
    };
    if (!first) {
      first = DeadlineMiss{
          .callback_id = number(0), .response_ns = number(1), .deadline_ns = number(2)};
    }
  }
  return first;
}

}  // namespace cie::record
