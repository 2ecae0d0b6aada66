#include "internal_endpoint.hpp"

#include <utility>

namespace cie_rclcpp {

InternalEndpoint::InternalEndpoint(std::shared_ptr<InternalServer> server,
                                   std::unique_ptr<Entity> entity, OnGone on_gone)
    : state_(std::make_shared<State>(std::move(server))), on_gone_(std::move(on_gone)) {
  state_->entity = std::move(entity);
  listen();
  state_->server->thread.add(*this);
}

void InternalEndpoint::listen() {
  if (std::exchange(listens_, true)) return;
  // Weakly: the state ends with the endpoint, not with the entity.
  state_->entity->connect([weak = std::weak_ptr{state_}, gone = farewell(on_gone_)](
                              Inbox::Source source, std::size_t count, int) {
    const auto state = weak.lock();
    if (!state || source == Inbox::Source::lost) return;
    (source == Inbox::Source::process ? state->from_process : state->from_middleware) += count;
    state->server->thread.wakeup().notify();
  });
}

void InternalEndpoint::rest() noexcept {
  if (std::exchange(listens_, false)) state_->entity->disconnect();
}

InternalEndpoint::~InternalEndpoint() {
  state_->has_ended.store(true);
  state_->server->thread.remove(*this);
  state_->leave_share();
  rest();
}

void InternalEndpoint::serve() noexcept {
  const auto state = state_;  // what is handled may end this
  serve(*state, Inbox::Source::middleware, state->from_middleware);
  serve(*state, Inbox::Source::process, state->from_process);
}

void InternalEndpoint::serve(State& state, Inbox::Source source,
                             std::atomic<std::uint64_t>& waiting) noexcept {
  while (waiting.load() > 0 && !state.has_ended.load()) {
    Admission::Entry entry = state.enter();
    if (!entry) return;
    waiting.fetch_sub(1);
    try {
      state.entity->run_next(source, 0, [&entry](std::int64_t, std::uint64_t) { entry.begin(); });
    } catch (...) {
      state.server->on_failure(std::current_exception());
    }
  }
}

}  // namespace cie_rclcpp
