// Runs a callback for each message of a topic. Made by Node::create_subscription.
#pragma once

#include <cie/executor/callback_handle.hpp>
#include <cie/executor/message.hpp>

#include <concepts>
#include <cstdint>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>

namespace cie {

namespace executor {
class SubscriptionCallback;
using MessageFunction =
    std::function<void(const std::shared_ptr<const void>& message, const MessageInfo& info)>;
std::uint32_t matched_writers(const SubscriptionCallback& callback);
}  // namespace executor

// What a subscription's callback may look like: it takes `const T&` or `shared_ptr<const T>`, and
// after it, if it likes, `const MessageInfo&`. A message taken by reference is valid until the
// callback returns; one taken by pointer for as long as the pointer is kept.
template <typename F, typename T>
concept SubscriptionFunction =
    std::invocable<F&, const T&> || std::invocable<F&, const T&, const MessageInfo&> ||
    std::invocable<F&, std::shared_ptr<const T>> || std::invocable < F&,
        std::shared_ptr<const T>,
const MessageInfo& > ;

// Ends with the last copy of its handle. That may outlive the node; it then is idle.
template <Message T>
class Subscription : public executor::CallbackHandle<executor::SubscriptionCallback> {
 public:
  using CallbackHandle::CallbackHandle;
  // Publishers connected now, in this process and others.
  std::uint32_t publisher_count() const { return executor::matched_writers(*callback_); }
};

namespace executor {
template <Message T, SubscriptionFunction<T> F>
MessageFunction erase_message_type(F function) {
  return [function = std::move(function)](const std::shared_ptr<const void>& message,
                                          const MessageInfo& info) mutable {
    if constexpr (std::invocable<F&, const T&, const MessageInfo&>) {
      function(*static_cast<const T*>(message.get()), info);
    } else if constexpr (std::invocable<F&, const T&>) {
      function(*static_cast<const T*>(message.get()));
    } else if constexpr (std::invocable<F&, std::shared_ptr<const T>, const MessageInfo&>) {
      function(std::static_pointer_cast<const T>(message), info);
    } else {
      function(std::static_pointer_cast<const T>(message));
    }
  };
}
}  // namespace executor

}  // namespace cie
