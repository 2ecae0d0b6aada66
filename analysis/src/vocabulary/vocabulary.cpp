#include "vocabulary.hpp"

#include <algorithm>
#include <map>

namespace cie::analysis {

const Translation* find_translation(std::string_view event) {
  static const auto all = [] {
    std::map<std::string_view, const Translation*> by_name;
    for (const auto* vocabulary :
         {&cie_vocabulary(), &ros2_vocabulary(), &kernel_vocabulary(), &lttng_vocabulary()}) {
      for (const auto& translation : *vocabulary)
        by_name.emplace(translation.event, &translation);
    }
    return by_name;
  }();
  const auto found = all.find(event);
  return found == all.end() ? nullptr : found->second;
}

bool is_callback_start(std::string_view event) {
  const auto* translation = find_translation(event);
  return translation != nullptr && translation->starts_callback;
}

const std::vector<FieldRequest>& context_requests() {
  static const std::vector<FieldRequest> requests{"vpid|perf_pid|pid", "vtid|perf_tid|tid",
                                                  "procname", "pid_ns"};
  return requests;
}

bool is_kernel_event(std::string_view event) {
  const auto& table = kernel_vocabulary();
  return std::any_of(table.begin(), table.end(), [event](const Translation& translation) {
    return translation.event == event;
  });
}

}  // namespace cie::analysis
