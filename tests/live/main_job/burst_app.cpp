// Two callbacks, each isolated on a thread of its own, that run as fast as they can: more events
// than small buffers hold. Prints how many hot events it emitted.
//
//   burst_app INSTANCES [--kill]
//
// --kill: then one instance more is started, and the process kills itself inside it.
#include <cie/tracepoints/trace.hpp>

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

int main(int argc, char** argv) {
  namespace trace = cie::trace;
  constexpr int kCallbacks = 2;
  const std::uint64_t instances = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1000;

  const bool is_killed = argc > 2 && std::string_view(argv[2]) == "--kill";

  const trace::Run run(cie::ExecutorKind::isolated, "");
  const trace::Node node("/burst");
  std::vector<std::thread> threads;
  for (int i = 0; i < kCallbacks; ++i) {
    threads.emplace_back([&node, i, instances, is_killed] {
      const trace::Group group(node.id(), cie::GroupType::mutually_exclusive);
      trace::CallbackInfo info;
      info.group = group.id();
      info.node = node.id();
      info.logical_id = "/burst@Timer(" + std::to_string(i + 1) + ")";
      info.period_ns = static_cast<std::uint64_t>(i + 1);
      trace::Callback callback(info);
      trace::Thread thread(cie::ThreadRole::callback, callback.id(), group.id(),
                           "burst" + std::to_string(i));
      thread.emit_sched(cie::SchedMoment::initial, 0);
      thread.emit_sched(cie::SchedMoment::applied, 0);
      for (std::uint64_t k = 0; k < instances; ++k) {
        callback.end(callback.start({}), cie::CallbackStatus::ok);
      }
      if (is_killed && i == 0) {
        callback.start({});
        std::raise(SIGKILL);
      }
    });
  }
  for (auto& thread : threads)
    thread.join();
  std::printf("%llu\n", static_cast<unsigned long long>(2 * kCallbacks * instances));
  return 0;
}
