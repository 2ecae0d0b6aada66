#include <cie/scheduling/spawned_threads.hpp>
#include <cie/scheduling/threads.hpp>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <exception>
#include <stdexcept>
#include <utility>

namespace cie::scheduling {

// What the function throws is handed over to the handler whole, so that who is told of it frees it.
void SpawnedThreads::run(const std::string& name, const Function& function,
                         std::stop_token stop) noexcept {
  std::exception_ptr failure;
  try {
    function(std::move(stop));
    return;
  } catch (...) {
    failure = std::current_exception();
  }
  failures_.on_failure(
      {.callback = kNoCallback, .logical_id = name, .exception = std::move(failure)});
}

void SpawnedThreads::start(const std::string& name, Function function) {
  const auto is_printable = [](unsigned char c) { return std::isprint(c) != 0; };
  if (name.empty() || name.size() > kMostThreadName || !std::ranges::all_of(name, is_printable)) {
    throw std::invalid_argument{"a thread cannot be named \"" + name +
                                "\": give it 1 to 15 printable characters"};
  }
  const auto stop = std::make_shared<std::stop_source>();
  const ThreadPlan plan{.role = ThreadRole::worker, .name = name};
  const auto thread =
      std::make_shared<Team>(TeamBody{.run = [this, name, function = std::move(function),
                                              stop] { run(name, function, stop->get_token()); },
                                      .stop = [stop] { stop->request_stop(); }},
                             std::vector{plan}, configurator_);
  configurator_.refuse_if_any(thread->wait_configured());  // then the thread ends with this scope
  const std::lock_guard lock{mutex_};
  if (has_ended_) {
    throw std::logic_error{"thread \"" + name + "\" was to be started by an executor that ends"};
  }
  threads_.push_back(thread);
  thread->open_gate();
}

void SpawnedThreads::end() {
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

}  // namespace cie::scheduling
