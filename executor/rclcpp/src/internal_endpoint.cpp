#include "internal_endpoint.hpp"

#include <utility>

namespace cie_rclcpp {

InternalEndpoint::InternalEndpoint(std::shared_ptr<InternalServer> server,
                                   std::unique_ptr<Entity> entity, const OnGone& on_gone)
    : server_(std::move(server)),
      entity_(std::move(entity)),
      waiting_(std::make_shared<std::atomic<std::uint64_t>>(0)) {
  entity_->connect([server = server_, waiting = waiting_, gone = farewell(on_gone)](
                       Inbox::Source, std::size_t count, int) {
    waiting->fetch_add(count);
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
  for (std::uint64_t waiting = waiting_->exchange(0); waiting > 0; --waiting) {
    try {
      entity_->run_next(Inbox::Source::middleware, 0, [](std::int64_t) {});
    } catch (...) {
      server_->on_failure(std::current_exception());
    }
  }
}

}  // namespace cie_rclcpp
