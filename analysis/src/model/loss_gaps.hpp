// Losses, and the edges of streams, as gaps of what is known.
#pragma once

#include "facts.hpp"

#include <cstddef>

namespace cie::analysis {

// `place`: in the model's losses.
Gap gap_of(const Loss& loss, std::size_t place);

// What a stream may lack outside of what it covers.
Gap edge_of(const Model& model, StreamIndex stream, TimeWindow window);

// One before the window that was asked for: of state, which holds in the window. `place`: in the model's losses_before.
Gap gap_before(const Loss& loss, std::size_t place);

// The first gap of applications' events on a machine that overlaps the two, edges included; null: there is none.
const Gap* user_gap(const Model& model, HostIndex host, Timestamp begin, Timestamp end,
                    EventKinds kinds = kUserKinds);

// The events of a domain.
EventKinds kinds_of(Domain domain) noexcept;

}  // namespace cie::analysis
