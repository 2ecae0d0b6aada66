#include <cie/analysis/response_time.hpp>

namespace cie::analysis {

std::optional<Duration> least_response_time(const Instance& instance) noexcept {
  if (!instance.end) return std::nullopt;
  return least_response_time(instance.release_source, instance.release.value_or(instance.start),
                             instance.start, *instance.end);
}

std::optional<Duration> response_time_or_bound(const Instance& instance) noexcept {
  return is_known(instance.release_source) ? response_time(instance)
                                           : least_response_time(instance);
}

}  // namespace cie::analysis
