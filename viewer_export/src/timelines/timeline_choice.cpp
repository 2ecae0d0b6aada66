#include "timeline_choice.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>

namespace cie::viewer_export {
namespace {

constexpr std::size_t kSlowest = 50;       // of each callback
constexpr std::size_t kRemarkable = 1000;  // of each callback

// The larger response first, by what is certain of it, as the page sorts them; the earlier one of
// equals, so that the order of arrival does not matter.
bool is_slower(const KeptInstance& a, const KeptInstance& b) {
  const auto key = [](const KeptInstance& i) {
    return std::tuple(i.least_response().value_or(-1), -i.start);
  };
  return key(a) > key(b);
}

}  // namespace

void TimelineChoice::add(const KeptInstance& instance) {
  const auto callback = at(instance.callback);
  if (callback >= lanes_.size()) lanes_.resize(callback + 1);
  Lane& lane = lanes_[callback];
  const std::uint64_t number = lane.seen++;
  if (number % lane.stride == 0) {
    lane.evenly.push_back(instance);
    lane.numbers.push_back(number);
    if (++kept_evenly_ > limit_) thin_out();
  }
  Lane& same = lanes_[callback];
  if ((!instance.numbers.is_known(KeptInstance::end) ||
       instance.numbers.value(KeptInstance::missed) > 0) &&
      same.remarkable.size() < kRemarkable) {
    same.remarkable.push_back(instance);
  }
  if (same.slowest.size() == kSlowest && !is_slower(instance, same.slowest.front())) return;
  if (same.slowest.size() == kSlowest) {
    std::ranges::pop_heap(same.slowest, is_slower);
    same.slowest.pop_back();
  }
  same.slowest.push_back(instance);
  std::ranges::push_heap(same.slowest, is_slower);
}

// Half of the callback that has most.
void TimelineChoice::thin_out() {
  Lane& lane = *std::ranges::max_element(lanes_, {},
                                         [](const Lane& l) { return std::tuple(l.evenly.size()); });
  lane.stride *= 2;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < lane.evenly.size(); ++i) {
    if (lane.numbers[i] % lane.stride != 0) continue;
    lane.evenly[kept] = lane.evenly[i];
    lane.numbers[kept] = lane.numbers[i];
    ++kept;
  }
  kept_evenly_ -= lane.evenly.size() - kept;
  lane.evenly.resize(kept);
  lane.numbers.resize(kept);
}

std::vector<TimelineChoice::Kept> TimelineChoice::take() {
  std::vector<Kept> result;
  for (Lane& lane : lanes_) {
    Kept& kept = result.emplace_back(Kept{.instances = std::move(lane.evenly), .of = lane.seen});
    std::ranges::move(lane.slowest, std::back_inserter(kept.instances));
    std::ranges::move(lane.remarkable, std::back_inserter(kept.instances));
    const auto identity = [](const KeptInstance& i) { return std::tuple(i.start, i.tid, i.seq); };
    std::ranges::sort(kept.instances, {}, identity);
    kept.instances.erase(
        std::unique(kept.instances.begin(), kept.instances.end(),
                    [&](const auto& a, const auto& b) { return identity(a) == identity(b); }),
        kept.instances.end());
  }
  lanes_.clear();
  kept_evenly_ = 0;
  return result;
}

}  // namespace cie::viewer_export
