#include "worker_threads.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <utility>

namespace cie::executor {

void WorkerThreads::start(const std::string& name, FunctionLoop::Function function,
                          const std::function<void(const std::vector<ParameterProblem>&)>& accept) {
  constexpr std::size_t kRoom = 15;  // TASK_COMM_LEN without its terminator
  const auto is_printable = [](unsigned char c) { return std::isprint(c) != 0; };
  if (name.empty() || name.size() > kRoom || !std::ranges::all_of(name, is_printable)) {
    throw std::invalid_argument{"a thread cannot be named \"" + name +
                                "\": give it 1 to 15 printable characters"};
  }
  auto loop = std::make_unique<FunctionLoop>(
      std::move(function), [this, name](std::exception_ptr exception) {
        on_failure_(
            {.callback = kNoCallback, .logical_id = name, .exception = std::move(exception)});
      });
  const ThreadPlan plan{.role = ThreadRole::worker, .name = name};
  const auto thread = std::make_shared<Team>(std::move(loop), std::vector{plan}, configurator_);
  accept(thread->wait_configured());  // a thread that is not accepted ends with this scope
  const std::lock_guard lock{mutex_};
  if (has_ended_) {
    throw std::logic_error{"thread \"" + name + "\" was to be started by an executor that ends"};
  }
  threads_.push_back(thread);
  thread->open_gate();
}

void WorkerThreads::end() {
  std::vector<std::shared_ptr<Team>> threads;
  {
    const std::lock_guard lock{mutex_};
    has_ended_ = true;
    threads.swap(threads_);
  }
  for (const auto& thread : threads)
    thread->stop();
  for (const auto& thread : threads)
    thread->join();
}

}  // namespace cie::executor
