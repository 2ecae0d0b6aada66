#include "addresses_in_turn.hpp"

#include "callback_questions.hpp"

#include <algorithm>
#include <iterator>
#include <vector>

namespace cie::analysis {

void note_addresses_in_turn(Model& model) {
  constexpr std::ptrdiff_t kAddressesOfOne = 2;
  std::vector<CallbackOnThread*> unregistered;
  std::vector<Timestamp> begins;
  std::vector<Timestamp> ends;
  for (auto& thread : model.threads) {
    unregistered.clear();
    for (auto* pair : thread.ran) {
      pair->is_of_several = false;
      const bool is_address = !is_of_its_own(model.callbacks[at(pair->callback)]);
      if (is_address && is_there_for_certain(model, *pair)) unregistered.push_back(pair);
    }
    if (std::ssize(unregistered) <= kAddressesOfOne) continue;
    begins.clear();
    ends.clear();
    for (const auto* pair : unregistered) {
      begins.push_back(pair->first_start.time);
      ends.push_back(pair->last_activity.time);
    }
    std::ranges::sort(begins);
    std::ranges::sort(ends);
    // When one more was used than is told of one callback.
    const auto is_too_many = [&](Timestamp time) {
      const auto begun = std::ranges::upper_bound(begins, time) - begins.begin();
      const auto ended = std::ranges::lower_bound(ends, time) - ends.begin();
      return begun - ended > kAddressesOfOne;
    };
    std::vector<Timestamp> several;
    std::ranges::copy_if(begins, std::back_inserter(several), is_too_many);
    for (auto* pair : unregistered) {
      const auto since = std::ranges::lower_bound(several, pair->first_start.time);
      pair->is_of_several = since != several.end() && *since <= pair->last_activity.time;
    }
  }
}

}  // namespace cie::analysis
