#include "internal_endpoint.hpp"

#include <utility>

namespace cie_rclcpp {

InternalEndpoint::InternalEndpoint(std::shared_ptr<InternalServer> server,
                                   std::unique_ptr<Entity> entity, const OnGone& on_gone)
    : server_(std::move(server)),
      entity_(std::move(entity)),
      waiting_(std::make_shared<Waiting>()) {
  entity_->connect([server = server_, waiting = waiting_, gone = farewell(on_gone)](
                       Inbox::Source source, std::size_t count, int) {
    if (source == Inbox::Source::lost) return;
    (source == Inbox::Source::process ? waiting->from_process : waiting->from_middleware) += count;
    server->thread.wakeup().notify();
  });
  server_->thread.add(*this);
}

InternalEndpoint::~InternalEndpoint() {
  server_->thread.remove(*this);
  entity_->disconnect();
}

void InternalEndpoint::serve() noexcept {
  if (!server_->is_open.load()) return;
  serve(Inbox::Source::middleware, waiting_->from_middleware);
  serve(Inbox::Source::process, waiting_->from_process);
}

void InternalEndpoint::serve(Inbox::Source source, std::atomic<std::uint64_t>& waiting) noexcept {
  for (std::uint64_t left = waiting.exchange(0); left > 0; --left) {
    try {
      entity_->run_next(source, 0, [](std::int64_t) {});
    } catch (...) {
      server_->on_failure(std::current_exception());
    }
  }
}

}  // namespace cie_rclcpp
