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

}  // namespace cie::analysis
