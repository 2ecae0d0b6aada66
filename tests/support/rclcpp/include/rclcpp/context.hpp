#pragma once

#include <atomic>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <rcl/types.h>
#include <rclcpp/macros.hpp>

namespace rclcpp {

struct OnShutdownCallbackHandle {
  std::weak_ptr<std::function<void()>> callback{};
};
enum class SignalHandlerOptions { All, SigInt, SigTerm, None };

class Context : public std::enable_shared_from_this<Context> {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Context)
  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  virtual ~Context();

  // Throws where it is initialised already.
  virtual void init(int argc, const char* const* argv);
  bool is_valid() const { return is_valid_.load(); }
  // False: it was not valid.
  virtual bool shutdown(const std::string& reason);
  std::shared_ptr<rcl_context_t> get_rcl_context();
  OnShutdownCallbackHandle add_on_shutdown_callback(std::function<void()> callback);
  bool remove_on_shutdown_callback(const OnShutdownCallbackHandle& handle);

 private:
  std::recursive_mutex init_mutex_;
  std::atomic<bool> is_valid_{false};
  std::mutex context_mutex_;
  std::shared_ptr<rcl_context_t> rcl_context_;
  std::mutex callbacks_mutex_;
  std::list<std::shared_ptr<std::function<void()>>> callbacks_;
};

std::vector<Context::SharedPtr> get_contexts();
namespace contexts {
Context::SharedPtr get_global_default_context();
}

void init(int argc, const char* const* argv,
          SignalHandlerOptions signals = SignalHandlerOptions::All);
bool ok(const Context::SharedPtr& context = nullptr);
bool shutdown(const Context::SharedPtr& context = nullptr,
              const std::string& reason = "user called rclcpp::shutdown()");
std::vector<std::string> remove_ros_arguments(int argc, const char* const* argv);

}  // namespace rclcpp
