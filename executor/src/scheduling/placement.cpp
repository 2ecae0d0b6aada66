#include <cie/scheduling/placement.hpp>
#include <cie/scheduling/pool_loop.hpp>
#include <cie/scheduling/serial_loop.hpp>

#include <algorithm>
#include <iterator>

namespace cie::scheduling {

std::unique_ptr<Loop> make_lean_loop(GroupType type, const LoopParts& parts) {
  if (type == GroupType::reentrant) return std::make_unique<PoolLoop>(parts);
  return std::make_unique<SerialLoop>(parts);
}

Placement::Teams Placement::serve(const Callbacks& callbacks) {
  Callbacks fresh;
  std::ranges::copy_if(callbacks, std::back_inserter(fresh),
                       [this](const auto& callback) { return !served_.contains(callback); });
  auto teams = place(fresh);
  served_.insert(fresh.begin(), fresh.end());
  return teams;
}

Placement::Vacating Placement::remove(const Callbacks& callbacks) {
  Callbacks removed;
  for (const auto& callback : callbacks) {
    if (served_.erase(callback) > 0) removed.push_back(callback);
  }
  if (removed.empty()) return [](Running) { return Teams{}; };
  return take_off(removed);
}

void Placement::clear() {
  served_.clear();
  reset();
}

void Placement::run(std::int64_t deadline_ns, Cancellation& cancellation) {
  cancellation.wait_until(deadline_ns);
}

}  // namespace cie::scheduling
