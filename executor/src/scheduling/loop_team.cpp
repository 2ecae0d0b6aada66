#include <cie/scheduling/clock.hpp>
#include <cie/scheduling/loop_team.hpp>

#include <algorithm>
#include <utility>

namespace cie::scheduling {

LoopTeam::LoopTeam(std::unique_ptr<Loop> loop, const std::vector<ThreadPlan>& plans,
                   ThreadConfigurator& configurator)
    : loop_(std::move(loop)),
      team_({.run = [this] { loop_->run(kNever); }, .stop = [this] { loop_->stop(); }}, plans,
            configurator) {}

void LoopTeam::add(const std::shared_ptr<Callback>& callback) {
  callback->move_to(id_);
  {
    const std::lock_guard lock{mutex_};
    callbacks_.push_back(callback);
  }
  loop_->add(callback);
}

void LoopTeam::take_out(const Callbacks& callbacks) {
  const std::lock_guard lock{mutex_};
  std::erase_if(callbacks_, [&callbacks](const auto& callback) {
    return std::ranges::find(callbacks, callback) != callbacks.end();
  });
}

void LoopTeam::remove(const Callbacks& callbacks) {
  take_out(callbacks);
  loop_->remove(callbacks);
}

void LoopTeam::abandon(const Callbacks& callbacks) {
  take_out(callbacks);
  loop_->abandon(callbacks);
}

void LoopTeam::stop() {
  team_.stop();
  Callbacks callbacks;
  {
    const std::lock_guard lock{mutex_};
    callbacks.swap(callbacks_);
  }
  for (const auto& callback : callbacks)
    callback->serve(nullptr);
}

}  // namespace cie::scheduling
