// By how much the clocks of several hosts differ, and how far messages between them can tell.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/report.hpp>

#include "facts.hpp"

#include <cstddef>
#include <optional>

namespace cie::analysis {

// Whose clock the whole recording's times are of: the first one's by name. Null without hosts.
const HostFacts* reference_host(const Model& model) noexcept;

// Then they do not differ by one amount for the whole recording.
bool is_any_clock_set(const Model& model, HostPair hosts);

// What to add to a time of one host's clock for that of another, as far as their wall clocks agree.
// Hosts of one boot are containers, which share the clock unless it was moved for one of them.
Duration clock_shift(const HostFacts& from, const HostFacts& to) noexcept;

// For a window, whose times are of one clock. Throws SeveralClocks where hosts do not share one.
void require_one_clock(const Model& model);

// What to add to a time span that begins on one host and ends on another, so that it is what one
// clock would have shown: no message arrives before it was sent, so the fastest one each way bounds
// by how much the clocks differ (one difference for the whole recording; Cristian: Probabilistic
// clock synchronization, 1989). Without a bound where no message went that way, and without any where
// one of the clocks was set, after which they differed by something else.
ClockError clock_error(const Model& model, HostPair from_to);
// The same of a chain, along all its messages, whichever of its routes they took. Empty: it ends on
// the host where it begins.
std::optional<ClockError> clock_error(const Model& model, const ChainFacts& chain);
// The same of one of its messages, by position. Empty: it stays on its host.
std::optional<ClockError> clock_error(const Model& model, const ChainFacts& chain,
                                      std::size_t message);

}  // namespace cie::analysis
