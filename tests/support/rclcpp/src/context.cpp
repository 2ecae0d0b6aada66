// Contexts, the arguments that they are made with, and guard conditions.
#include "arguments.hpp"

#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <rclcpp/rclcpp.hpp>

namespace rclcpp {

namespace {

constexpr std::string_view kRosArguments = "--ros-args";

// -p NODE:NAME:=VALUE or -p NAME:=VALUE
rcl_arguments_impl_t::Override parsed(const std::string& rule) {
  const auto sign = rule.find(":=");
  if (sign == std::string::npos) throw std::invalid_argument{"not a parameter: " + rule};
  const auto colon = rule.rfind(':', sign - 1);
  if (colon == std::string::npos)
    return {.node = "/**", .name = rule.substr(0, sign), .value = rule.substr(sign + 2)};
  return {.node = rule.substr(0, colon),
          .name = rule.substr(colon + 1, sign - colon - 1),
          .value = rule.substr(sign + 2)};
}

// Which of the arguments are ROS 2's.
std::vector<bool> of_ros(int argc, const char* const* argv) {
  std::vector<bool> found;
  bool is_inside = false;
  for (int i = 0; i < argc; ++i) {
    const std::string_view word = argv[i];
    const bool begins = word == kRosArguments;
    found.push_back(is_inside || begins);
    is_inside = begins || (is_inside && word != "--");
  }
  return found;
}

struct AllContexts {
  std::mutex mutex;
  std::vector<std::weak_ptr<Context>> contexts;
  static AllContexts& get() {
    static AllContexts& all = *new AllContexts;
    return all;
  }
};

}  // namespace

Context::~Context() { shutdown("the context was destroyed"); }

void Context::init(int argc, const char* const* argv) {
  const std::lock_guard lock{init_mutex_};
  if (is_valid()) throw std::runtime_error{"context is already initialized"};
  auto arguments = std::make_shared<rcl_arguments_impl_t>();
  const auto is_of_ros = of_ros(argc, argv);
  for (int i = 0; i + 1 < argc; ++i) {
    const std::string_view word = argv[i];
    if (is_of_ros[static_cast<std::size_t>(i)] && (word == "-p" || word == "--param"))
      arguments->overrides.push_back(parsed(argv[i + 1]));
  }
  {
    const std::lock_guard of_context{context_mutex_};
    rcl_context_ = std::make_shared<rcl_context_t>(rcl_context_t{{std::move(arguments)}});
  }
  is_valid_.store(true);
  AllContexts& all = AllContexts::get();
  const std::lock_guard of_all{all.mutex};
  std::erase_if(all.contexts, [](const auto& each) { return each.expired(); });
  all.contexts.push_back(weak_from_this());
}

bool Context::shutdown(const std::string&) {
  const std::lock_guard lock{init_mutex_};
  if (!is_valid_.exchange(false)) return false;
  const std::lock_guard of_callbacks{callbacks_mutex_};
  for (const auto& callback : callbacks_)
    (*callback)();
  return true;
}

std::shared_ptr<rcl_context_t> Context::get_rcl_context() {
  const std::lock_guard lock{context_mutex_};
  return rcl_context_;
}

OnShutdownCallbackHandle Context::add_on_shutdown_callback(std::function<void()> callback) {
  const std::lock_guard lock{callbacks_mutex_};
  callbacks_.push_back(std::make_shared<std::function<void()>>(std::move(callback)));
  return {callbacks_.back()};
}
bool Context::remove_on_shutdown_callback(const OnShutdownCallbackHandle& handle) {
  const std::lock_guard lock{callbacks_mutex_};
  return std::erase(callbacks_, handle.callback.lock()) > 0;
}

Context::SharedPtr contexts::get_global_default_context() {
  static const auto context = std::make_shared<Context>();
  return context;
}

std::vector<std::string> remove_ros_arguments(int argc, const char* const* argv) {
  const auto is_of_ros = of_ros(argc, argv);
  std::vector<std::string> others;
  for (int i = 0; i < argc; ++i) {
    if (!is_of_ros[static_cast<std::size_t>(i)]) others.emplace_back(argv[i]);
  }
  return others;
}

std::vector<Context::SharedPtr> get_contexts() {
  AllContexts& all = AllContexts::get();
  const std::lock_guard lock{all.mutex};
  std::vector<Context::SharedPtr> found;
  for (const auto& each : all.contexts) {
    if (auto alive = each.lock()) found.push_back(std::move(alive));
  }
  return found;
}

bool ok(const Context::SharedPtr& context) {
  return (context ? context : contexts::get_global_default_context())->is_valid();
}

GuardCondition::GuardCondition(const Context::SharedPtr& context) : context_(context) {
  if (!context_) throw std::invalid_argument{"context argument unexpectedly nullptr"};
}
void GuardCondition::trigger() {
  const std::lock_guard lock{mutex_};
  if (on_trigger_) {
    on_trigger_(1);
  } else {
    ++unread_;
  }
}
void GuardCondition::set_on_trigger_callback(std::function<void(std::size_t)> callback) {
  const std::lock_guard lock{mutex_};
  on_trigger_ = std::move(callback);
  if (on_trigger_ && unread_ > 0) on_trigger_(std::exchange(unread_, 0));
}

}  // namespace rclcpp
