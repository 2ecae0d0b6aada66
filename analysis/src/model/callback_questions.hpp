// What follows from the facts about a callback.
#pragma once

#include <cie/analysis/time.hpp>

#include "facts.hpp"

#include <cstdint>
#include <optional>

namespace cie::analysis {

// Instances of the callback that are known to have run, seen or counted.
std::uint64_t known_instances(const Model& model, const CallbackFacts& callback);

// Of the channel that the stream belongs to, by its host's clock.
std::optional<Timestamp> end_of_window(const Model& model, StreamIndex stream);

}  // namespace cie::analysis
