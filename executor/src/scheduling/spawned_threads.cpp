#include <cie/scheduling/spawned_threads.hpp>
#include <cie/scheduling/team.hpp>
#include <cie/scheduling/threads.hpp>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <exception>
#include <optional>
#include <stdexcept>
#include <utility>

namespace cie::scheduling {

struct SpawnedThreads::Spawned {
  std::string name;
  Function function;
  std::stop_source stop{};
  std::optional<Team> team{};
};

// What the function throws is handed over to the handler whole, so that who is told of it frees it.
void SpawnedThreads::run(Spawned& spawned) noexcept {
  std::exception_ptr failure;
  try {
    spawned.function(spawned.stop.get_token());
  } catch (...) {
    failure = std::current_exception();
  }
  spawned.function = nullptr;
  if (failure == nullptr) return;
  failures_.on_failure(
      {.callback = kNoCallback, .logical_id = spawned.name, .exception = std::move(failure)});
}

// A thread cannot join itself: it joins the one that returned before it.
void SpawnedThreads::retire(Spawned& spawned) noexcept {
  SpawnedPtr former;
  const std::lock_guard lock{mutex_};
  const auto self = std::ranges::find(threads_, &spawned, &SpawnedPtr::get);
  if (self == threads_.end()) return;  // end() joins it
  former = std::exchange(returned_, std::move(*self));
  threads_.erase(self);
}

void SpawnedThreads::start(const std::string& name, Function function) {
  const auto is_printable = [](unsigned char c) { return std::isprint(c) != 0; };
  if (name.empty() || name.size() > kMostThreadName || !std::ranges::all_of(name, is_printable)) {
    throw std::invalid_argument{"a thread cannot be named \"" + name +
                                "\": give it 1 to 15 printable characters"};
  }
  const auto spawned = std::make_shared<Spawned>();
  spawned->name = name;
  spawned->function = std::move(function);
  const TeamBody body{.run =
                          [this, self = spawned.get()] {
                            run(*self);
                            retire(*self);
                          },
                      .stop = [stop = spawned->stop]() mutable { stop.request_stop(); }};
  const ThreadPlan plan{.role = ThreadRole::worker, .name = name};
  spawned->team.emplace(body, std::vector{plan}, configurator_);
  // If it is refused the thread ends with this scope.
  configurator_.refuse_if_any(spawned->team->wait_configured());
  const std::lock_guard lock{mutex_};
  if (has_ended_) {
    throw std::logic_error{"thread \"" + name + "\" was to be started by an executor that ends"};
  }
  threads_.push_back(spawned);
  spawned->team->open_gate();
}

void SpawnedThreads::end() {
  std::vector<SpawnedPtr> threads;
  {
    const std::lock_guard lock{mutex_};
    has_ended_ = true;
    threads.swap(threads_);
    if (returned_ != nullptr) threads.push_back(std::move(returned_));
  }
  for (const auto& thread : threads)
    thread->team->stop();
  for (const auto& thread : threads)
    thread->team->join();
}

}  // namespace cie::scheduling
