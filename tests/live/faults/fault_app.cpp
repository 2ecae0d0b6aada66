// An application that counts what it emits where nothing that happens to it can take the count
// away: in a file that it maps.
//
//   fault_app FOLDER [--instances N] [--period-us N] [--ready FILE] [--fork] [--reuse-tid] [--spin]
//
// One callback on a thread of its own, until it has run N times (0: until SIGTERM). FOLDER gets a
// file with two 64-bit numbers per process: hot events begun, hot events emitted. --fork: a child
// that calls no exec() does the same by a run of its own. --reuse-tid: a second callback gets a
// thread of the first one's, ended, thread id.
#include <cie/tracepoints/trace.hpp>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

namespace trace = cie::trace;

struct Options {
  std::string folder;
  std::string ready;
  std::uint64_t instances = 0;
  std::uint64_t period_us = 0;
  bool has_child = false;
  bool reuses_tid = false;
};

// Lives as long as the file: shared memory outlives SIGKILL.
struct Count {
  std::atomic<std::uint64_t> begun;
  std::atomic<std::uint64_t> emitted;
};

std::atomic<bool> is_asked_to_stop{false};

[[noreturn]] void fail(const char* what) {
  std::perror(what);
  std::exit(64);
}

Count& count_in(const std::string& folder) {
  std::string name = folder + "/XXXXXX";
  const int file = mkstemp(name.data());
  if (file < 0 || ftruncate(file, sizeof(Count)) != 0) fail("count");
  void* memory = mmap(nullptr, sizeof(Count), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (memory == MAP_FAILED) fail("mmap");
  return *static_cast<Count*>(memory);
}

Options parse(int argc, char** argv) {
  Options options;
  if (argc < 2) std::exit(64);
  options.folder = argv[1];
  for (int i = 2; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--fork") {
      options.has_child = true;
    } else if (name == "--reuse-tid") {
      options.reuses_tid = true;
    } else if (i + 1 < argc && name == "--instances") {
      options.instances = std::stoull(argv[++i]);
    } else if (i + 1 < argc && name == "--period-us") {
      options.period_us = std::stoull(argv[++i]);
    } else if (i + 1 < argc && name == "--ready") {
      options.ready = argv[++i];
    } else {
      std::exit(64);
    }
  }
  return options;
}

// On this thread, which it is the only one of. Returns its id.
pid_t run_callback(const trace::Node& node, const Options& options, Count& count,
                   const std::string& name) {
  const trace::Group group(node.id(), cie::GroupType::mutually_exclusive);
  trace::Callback callback({.group = group.id(),
                            .node = node.id(),
                            .kind = cie::CallbackKind::timer,
                            .logical_id = "/fault@Timer(" + name + ")",
                            .period_ns = 1'000'000});
  trace::Thread thread(cie::ThreadRole::callback, callback.id(), group.id(), "fault");
  thread.emit_sched(cie::SchedMoment::initial, 0);
  thread.emit_sched(cie::SchedMoment::applied, 0);
  if (!options.ready.empty()) {
    std::ofstream(options.ready + ".tmp") << getpid() << '\n';
    std::rename((options.ready + ".tmp").c_str(), options.ready.c_str());
  }
  for (std::uint64_t i = 0; options.instances == 0 ? !is_asked_to_stop : i < options.instances;
       ++i) {
    ++count.begun;
    const std::uint64_t seq = callback.start({});
    ++count.emitted;
    ++count.begun;
    callback.end(seq, cie::CallbackStatus::ok);
    ++count.emitted;
    if (options.period_us > 0)
      std::this_thread::sleep_for(std::chrono::microseconds(options.period_us));
  }
  return gettid();
}

void run_with_the_same_thread_id(const trace::Node& node, const Options& options, Count& count) {
  pid_t former = 0;
  std::thread([&] { former = run_callback(node, options, count, "1"); }).join();
  // The kernel gives the next thread the number after this one, if it is free.
  constexpr int kMostTries = 100;
  for (int i = 0; i < kMostTries; ++i) {
    std::ofstream("/proc/sys/kernel/ns_last_pid") << former - 1 << std::flush;
    bool is_same = false;
    std::thread([&] {
      is_same = gettid() == former;
      if (is_same) run_callback(node, options, count, "2");
    }).join();
    if (is_same) return;
  }
  std::puts("the thread id was not given again");
  std::exit(65);
}

void run(const Options& options, const std::string& name) {
  Count& count = count_in(options.folder);
  const trace::Run run(cie::ExecutorKind::isolated, "");
  const trace::Node node("/fault");
  if (options.reuses_tid) {
    run_with_the_same_thread_id(node, options, count);
  } else {
    std::thread([&] { run_callback(node, options, count, name); }).join();
  }
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  std::signal(SIGTERM, [](int) { is_asked_to_stop = true; });
  pid_t child = -1;
  if (options.has_child) {
    // Without its library for fork(), a child inherits locks of LTTng that are held at that moment:
    // once the process is registered they are not. For the same reason the child leaves out LTTng's
    // end.
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    child = fork();
  }
  run(options, child == 0 ? "2" : "1");
  if (child == 0) _exit(0);
  int status = 0;
  if (child > 0) waitpid(child, &status, 0);
  return status == 0 ? 0 : 66;
}
