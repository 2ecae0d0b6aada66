#include <cie/scheduling/team.hpp>
#include <cie/scheduling/threads.hpp>

#include "signals_blocked.hpp"

#include <array>
#include <csignal>
#include <cstddef>
#include <string>
#include <system_error>
#include <utility>

namespace cie::scheduling {

namespace {

// What a thread does wrong itself, and what counts its time. All else is for the process: its handler
// would run at a callback's priority, and cut its system calls short.
constexpr std::array kOfTheThread{SIGSEGV, SIGBUS,  SIGFPE,  SIGILL,    SIGTRAP,
                                  SIGSYS,  SIGABRT, SIGPROF, SIGVTALRM, SIGXCPU};

// "cannot start the thread "plan", of callback "/planner@Timer(10)" (why)": the exception adds what the errno says.
std::string no_thread(const ThreadPlan& plan, const std::string& why) {
  auto text = "cannot start the thread \"" + plan.name + '"';
  for (std::size_t i = 0; i < plan.callbacks.size(); ++i)
    text += (i == 0 ? ", of callback \"" : ", \"") + plan.callbacks[i].id + '"';
  return text + " (" + why + ')';
}

}  // namespace

Team::Team(TeamBody body, const std::vector<ThreadPlan>& plans, ThreadConfigurator& configurator)
    : body_(std::move(body)),
      configurator_(configurator),
      present_(plans.size()),
      unconfigured_(plans.size()) {
  const SignalsBlocked while_starting{kOfTheThread};
  const ThreadPlan* starting = nullptr;
  try {
    for (const ThreadPlan& plan : plans) {
      starting = &plan;
      threads_.emplace_back([this, plan] {
        run(plan);
        present_.fetch_sub(1, std::memory_order_release);
      });
    }
  } catch (const std::system_error& error) {
    stop();
    join();
    if (starting == nullptr) throw;
    throw std::system_error{error.code(),
                            no_thread(*starting, configurator.why_no_thread(error.code().value()))};
  } catch (...) {
    stop();
    join();
    throw;
  }
}

Team::~Team() {
  stop();
  join();
}

void Team::run(const ThreadPlan& plan) noexcept {
  set_current_thread_name(plan.name);
  try {
    trace::Thread thread{plan.role, plan.callback, plan.group, plan.name};
    thread.emit_sched(SchedMoment::initial, 0);
    auto problems = configurator_.prepare_stack(plan.name);
    const auto configured =
        configurator_.configure(thread, {.name = plan.name, .callbacks = plan.callbacks});
    problems.insert(problems.end(), configured.problems.begin(), configured.problems.end());
    {
      std::unique_lock lock{mutex_};
      problems_.insert(problems_.end(), problems.begin(), problems.end());
      --unconfigured_;
      changed_.notify_all();
      changed_.wait(lock, [this] { return gate_ != Gate::closed; });
      if (gate_ == Gate::leave) return;
    }
    body_.run();
  } catch (...) {
    // Setting up failed (memory, a handler that threw): whoever waits at the gate is told.
    const std::lock_guard lock{mutex_};
    failure_ = std::current_exception();
    unconfigured_ = unconfigured_ > 0 ? unconfigured_ - 1 : 0;
    changed_.notify_all();
  }
}

std::vector<SchedulingProblem> Team::wait_configured() {
  std::unique_lock lock{mutex_};
  changed_.wait(lock, [this] { return unconfigured_ == 0; });
  if (failure_) std::rethrow_exception(failure_);
  return problems_;
}

void Team::set_gate(Gate gate) {
  const std::lock_guard lock{mutex_};
  if (gate_ == Gate::closed) gate_ = gate;
  changed_.notify_all();
}

void Team::open_gate() { set_gate(Gate::open); }

void Team::stop() {
  body_.stop();
  set_gate(Gate::leave);
}

void Team::join() {
  const std::lock_guard lock{join_mutex_};
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
}

}  // namespace cie::scheduling
