// Which callbacks a view shows, and in which order.
#pragma once

#include "snapshot.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::live {

enum class SortKey : std::uint8_t { response, p50, max, rate, late, missed, name };

// "p99" (of the window; the default), "p50", "max", "rate", "late", "missed", "name".
std::string_view label(SortKey key) noexcept;
std::optional<SortKey> sort_key(std::string_view text) noexcept;

// Callbacks whose id, name, host or pid contains `filter` (any case), the largest first; by name: in
// alphabetical order. What is not measured comes last. Borrowed from `snapshot`.
std::vector<const CallbackView*> choose(const Snapshot& snapshot, SortKey key,
                                        std::string_view filter);

}  // namespace cie::live
