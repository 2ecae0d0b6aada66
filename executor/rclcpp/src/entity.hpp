// What a callback group holds, in one form: how it tells that something came, and how that is taken
// and handled.
#pragma once

#include "inbox.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <rclcpp/client.hpp>
#include <rclcpp/service.hpp>
#include <rclcpp/subscription_base.hpp>
#include <rclcpp/waitable.hpp>

namespace cie_rclcpp {

// A subscription, service, client or waitable of rclcpp. It is held weakly: who created it decides
// when it ends, and then nothing more comes from here.
class Entity {
 public:
  // The message's source timestamp, CLOCK_REALTIME, and a number of its writer's; 0: none. Called between
  // taking and handling.
  using Begin = std::function<void(std::int64_t source_timestamp_ns, std::uint64_t writer)>;
  // `count` came; `entity` is a waitable's own number for what did. On any thread.
  using Notice = std::function<void(Inbox::Source source, std::size_t count, int entity)>;

  Entity() = default;
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;
  virtual ~Entity() = default;

  // What tells it from others of its kind, in logical ids: a topic, a service, a type.
  virtual std::string name() const = 0;
  virtual cie::CallbackKind kind() const noexcept = 0;
  // Of the queue in the middleware, and in the process; 0: none, or without bound.
  virtual std::size_t depth() const { return 0; }
  virtual std::size_t process_depth() const { return 0; }
  // Whether the middleware's queue also holds what is for others, and was announced all the same.
  virtual bool is_shared() const { return false; }
  // From now on `notice` is told; what came before, at once. Throws what rclcpp throws. The copy of
  // `notice` that the entity keeps goes with it.
  virtual void connect(Notice notice) = 0;
  virtual void disconnect() noexcept = 0;
  // How many messages the middleware lost since the last time; asked for after such a notice.
  virtual std::uint32_t take_lost() noexcept { return 0; }
  // Takes one and handles it, with `begin` between; false, without `begin`, if there is none. Throws
  // what the user's function throws.
  virtual bool run_next(Inbox::Source source, int entity, const Begin& begin) = 0;
};

std::unique_ptr<Entity> make_entity(const rclcpp::SubscriptionBase::SharedPtr& subscription);
std::unique_ptr<Entity> make_entity(const rclcpp::ServiceBase::SharedPtr& service);
std::unique_ptr<Entity> make_entity(const rclcpp::ClientBase::SharedPtr& client);
// `owner`: the subscription whose events it handles; null: none.
std::unique_ptr<Entity> make_entity(const rclcpp::Waitable::SharedPtr& waitable,
                                    const rclcpp::SubscriptionBase::SharedPtr& owner);
// Which of the subscriptions that is.
rclcpp::SubscriptionBase::SharedPtr owner_of(
    const rclcpp::Waitable::SharedPtr& waitable,
    const std::vector<rclcpp::SubscriptionBase::WeakPtr>& subscriptions);

// Whether the waitable is a subscription's end within the process, which may outlive it.
bool is_of_subscription(const rclcpp::Waitable& waitable);

// Whether the waitable is a handler of QoS events that rclcpp made itself, which only warns. Since Iron
// a user's handler of incompatible QoS or type cannot be told from it.
bool is_default_event_handler(const rclcpp::Waitable& waitable);

}  // namespace cie_rclcpp
