// What rclcpp serves for itself, on a thread beside those of callbacks.
#pragma once

#include <cie/scheduling/background_server.hpp>

#include "admission.hpp"
#include "entity.hpp"
#include "entity_callback.hpp"

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <utility>

namespace cie_rclcpp {

// The thread of it, and what it needs to know of its executor.
struct InternalServer {
  // Told of what a function of the user's threw there, such as a parameter's.
  std::function<void(std::exception_ptr)> on_failure;
  const std::shared_ptr<Admission> admission = std::make_shared<Admission>();  // of callbacks, too
  cie::scheduling::BackgroundServer thread{"cie-rclcpp"};
};

// Parameter services, /parameter_events and the like: no callback of the user's, none in the trace.
class InternalEndpoint final : public cie::scheduling::BackgroundServer::Endpoint {
 public:
  // Listens from now on. Throws what rclcpp throws.
  InternalEndpoint(std::shared_ptr<InternalServer> server, std::unique_ptr<Entity> entity,
                   OnGone on_gone);
  ~InternalEndpoint() override;

  // Between spins nothing listens: a LifecycleNode of Humble ends the handles of its services before these,
  // which then end what listens. What comes meanwhile waits. Not both at once; throws what rclcpp throws.
  void listen();
  void rest() noexcept;

  void serve() noexcept override;
  std::shared_ptr<Admitted> admitted() const noexcept { return state_; }

 private:
  // Shared with the notice, and with a serve() in which the endpoint goes.
  struct State final : Admitted {
    explicit State(std::shared_ptr<InternalServer> internal)
        : Admitted(internal->admission), server(std::move(internal)) {}
    using Admitted::enter;
    using Admitted::leave_share;
    std::uint64_t waiting() const noexcept override { return from_middleware + from_process; }
    std::int64_t ready_at() const noexcept override {
      return waiting() > 0 ? 0 : cie::scheduling::kNever;
    }
    void wake() noexcept override { server->thread.wakeup().notify(); }

    const std::shared_ptr<InternalServer> server;
    std::unique_ptr<Entity> entity;
    std::atomic<std::uint64_t> from_middleware{0};  // how many wait
    std::atomic<std::uint64_t> from_process{0};
    std::atomic<bool> has_ended{false};
  };
  static void serve(State& state, Inbox::Source source,
                    std::atomic<std::uint64_t>& waiting) noexcept;

  const std::shared_ptr<State> state_;
  const OnGone on_gone_;
  bool listens_ = false;
};

}  // namespace cie_rclcpp
