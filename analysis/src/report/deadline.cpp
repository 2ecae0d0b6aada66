#include <cie/analysis/deadline.hpp>

namespace cie::analysis {

std::optional<Duration> response_deadline(const SpecEntry* entry,
                                          std::uint64_t declared_ns) noexcept {
  if (entry != nullptr && entry->response_deadline_ns) {
    return Duration{*entry->response_deadline_ns};
  }
  if (declared_ns == 0) return std::nullopt;
  return Duration{signed_ns(declared_ns)};
}

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
