// A traced application for the live tests: one timer and one subscription, each on its own thread,
// and a publisher, driven by the facade alone.
//
//   traced_app [--instances N] [--period-us N] [--until-signal] [--leave-by HOW]
//              [--burst N] [--status N] [--ready FILE [--ready-after N]] [--fork]
//              [--deadline-us N [--late-every N]] [--lost N] [--unsent N]
//
// HOW is return, exit, abort, exec (another program, in place of this one), exec-elsewhere (the
// same on the thread that runs the callbacks) or kill: as a process that is killed when it has
// registered with the tracer, and emitted nothing yet. --fork: a child runs an instance of what it
// inherited, destroys that and calls exit(). Writes FILE (its pid) once everything is registered,
// or after the burst and N instances. --late-every: each N-th instance of the timer responds after
// three times its deadline. Prints the totals it emitted on exit.
#include <cie/tracepoints/trace.hpp>

#include "support/sanitizers.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

namespace {

namespace trace = cie::trace;

struct Options {
  std::uint64_t instances = 10;
  std::uint64_t period_us = 1000;
  std::uint64_t burst = 0;
  std::uint64_t deadline_us = 0;  // that the timer declares
  std::uint64_t late_every = 0;
  std::uint64_t work_us = 0;  // on a CPU, in each instance of the timer
  bool is_until_signal = false;
  bool has_child = false;
  std::string leave_by = "return";
  int status = 0;
  std::string ready;
  std::uint64_t ready_after = 0;
  std::uint32_t lost = 0;    // samples of the subscription, before anything is written to FILE
  std::uint64_t unsent = 0;  // messages, when all instances have run
};

std::atomic<bool> is_asked_to_stop{false};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--until-signal") {
      options.is_until_signal = true;
      continue;
    }
    if (name == "--fork") {
      options.has_child = true;
      continue;
    }
    if (i + 1 >= argc) {
      std::exit(64);
    }
    const std::string value = argv[++i];
    if (name == "--instances") {
      options.instances = std::stoull(value);
    } else if (name == "--period-us") {
      options.period_us = std::stoull(value);
    } else if (name == "--work-us") {
      options.work_us = std::stoull(value);
    } else if (name == "--deadline-us") {
      options.deadline_us = std::stoull(value);
    } else if (name == "--late-every") {
      options.late_every = std::stoull(value);
    } else if (name == "--burst") {
      options.burst = std::stoull(value);
    } else if (name == "--lost") {
      options.lost = static_cast<std::uint32_t>(std::stoul(value));
    } else if (name == "--unsent") {
      options.unsent = std::stoull(value);
    } else if (name == "--leave-by") {
      options.leave_by = value;
    } else if (name == "--status") {
      options.status = std::stoi(value);
    } else if (name == "--ready") {
      options.ready = value;
    } else if (name == "--ready-after") {
      options.ready_after = std::stoull(value);
    } else {
      std::exit(64);
    }
  }
  return options;
}

struct Application {
  explicit Application(std::uint64_t deadline_us) : deadline_ns(deadline_us * 1000) {}

  std::uint64_t deadline_ns;
  trace::Run run{cie::ExecutorKind::isolated, ""};
  trace::Node node{"/test/node"};
  trace::Group timer_group{node.id(), cie::GroupType::mutually_exclusive};
  trace::Group subscription_group{node.id(), cie::GroupType::mutually_exclusive};
  trace::Publisher publisher{node.id(), "/test/topic", 0x1234};
  trace::Callback timer{{.group = timer_group.id(),
                         .node = node.id(),
                         .kind = cie::CallbackKind::timer,
                         .logical_id = trace::unique_logical_id("/test/node@Timer(1000000)"),
                         .source = "",
                         .symbol = "on_timer",
                         .period_ns = 1'000'000,
                         .deadline_ns = deadline_ns}};
  trace::Callback subscription{
      {.group = subscription_group.id(),
       .node = node.id(),
       .kind = cie::CallbackKind::subscription,
       .logical_id = trace::unique_logical_id("/test/node@Subscription(/test/topic)"),
       .source = "/test/topic",
       .symbol = "on_message",
       .queue_depth = 5}};
};

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::int64_t cpu_time_ns() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

void run_instance(Application& app, std::int64_t release_ns, std::uint64_t work_us = 0) {
  const std::uint64_t timer_seq =
      app.timer.start({.kind = cie::ReleaseKind::timer, .release_ns = release_ns});
  for (const auto end = cpu_time_ns() + static_cast<std::int64_t>(work_us) * 1000;
       cpu_time_ns() < end;) {
  }
  const std::int64_t stamp = app.publisher.publish();
  app.subscription.release(0);
  app.timer.end(timer_seq, cie::CallbackStatus::ok, release_ns);
  const std::uint64_t seq = app.subscription.start({.kind = cie::ReleaseKind::data,
                                                    .release_ns = release_ns,
                                                    .source_timestamp_realtime_ns = stamp,
                                                    .writer_gid = 0x1234});
  app.subscription.end(seq, cie::CallbackStatus::ok);
}

void tell_ready(const std::string& file) {
  std::ofstream(file + ".tmp") << getpid() << '\n';
  std::rename((file + ".tmp").c_str(), file.c_str());
}

void execute_another_program() {
  execl("/bin/true", "true", static_cast<char*>(nullptr));
  std::abort();
}

void work(Application& app, const Options& options) {
  const trace::Thread thread(cie::ThreadRole::pool, cie::kNoCallback, cie::kNoGroup, "pool");
  if (options.lost != 0) app.subscription.sample_lost(options.lost);
  const bool is_telling = !options.ready.empty();
  if (is_telling && options.ready_after == 0) tell_ready(options.ready);
  for (std::uint64_t i = 0; i < options.burst; ++i) {
    run_instance(app, now_ns());
  }
  for (std::uint64_t i = 0; options.is_until_signal ? !is_asked_to_stop : i < options.instances;
       ++i) {
    trace::thread_wakeup(app.timer.id(), cie::WakeupReason::timer);
    const bool is_late = options.late_every != 0 && (i + 1) % options.late_every == 0;
    const auto late_by = static_cast<std::int64_t>(is_late ? 3 * options.deadline_us * 1000 : 0);
    run_instance(app, now_ns() - late_by, options.work_us);
    if (is_telling && i + 1 == options.ready_after) tell_ready(options.ready);
    std::this_thread::sleep_for(std::chrono::microseconds(options.period_us));
  }
  for (std::uint64_t total = 1; total <= options.unsent; ++total)
    app.publisher.failed(app.publisher.publish(), total);
  if (options.leave_by == "exec-elsewhere") execute_another_program();
  if (options.work_us > 0) {
    std::printf("thread %d used %lld ns\n", gettid(), static_cast<long long>(cpu_time_ns()));
  }
}

}  // namespace

#ifdef CIE_THREAD_SANITIZER
// LTTng publishes its probes by RCU from a library that ThreadSanitizer does not see into.
extern "C" const char* __tsan_default_suppressions() {  // NOLINT: the name is the sanitizer's
  return "race:lttng_ust_tracepoint_cb_cie___*";
}
#endif

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  if (options.leave_by == "kill") {
    std::raise(SIGKILL);
  }
  for (const int signal : {SIGTERM, SIGINT}) {
    std::signal(signal, [](int) { is_asked_to_stop = true; });
  }
  auto app = std::make_unique<Application>(options.deadline_us);
  if (options.has_child) {
    const pid_t child = fork();
    if (child == 0) {
      trace::thread_wakeup(app->timer.id(), cie::WakeupReason::timer);
      run_instance(*app, now_ns());
      app.reset();
      std::exit(0);  // runs the library's exit handlers too
    }
    waitpid(child, nullptr, 0);
  }
  std::thread(work, std::ref(*app), std::cref(options)).join();
  app->subscription.overwritten(2);
  app->subscription.overwritten(1);  // old news
  std::printf("instances %llu\n", static_cast<unsigned long long>(app->timer.next_seq()));
  std::fflush(stdout);
  if (options.leave_by == "abort") {
    std::abort();
  }
  if (options.leave_by == "exit") {
    std::exit(options.status);  // the application is still alive, and leaks
  }
  if (options.leave_by == "exec") execute_another_program();
  return options.status;
}
