#include "kernel/kernel_trial.hpp"

#include "kernel/kernel_reader.hpp"
#include "kernel/switch_check.hpp"
#include "system/error.hpp"

#include <stop_token>
#include <string_view>
#include <thread>

#include <nlohmann/json.hpp>
#include <sched.h>

namespace cie::record {
namespace {

using std::chrono::milliseconds;
using Json = nlohmann::ordered_json;

class Counter final : public KernelEventSink {
 public:
  void on_event(std::uint64_t /*time*/, std::string_view event) override { check_.on_event(event); }
  void on_loss(std::uint64_t /*time*/, std::uint64_t /*total*/) override { check_.on_loss(); }
  const SwitchCheck& check() const noexcept { return check_; }

 private:
  SwitchCheck check_;
};

// Two switches a millisecond, on that CPU where the thread may run there.
void wake_often(const std::stop_token& stop, std::uint32_t cpu) {
  cpu_set_t mask;
  CPU_ZERO(&mask);
  CPU_SET(cpu, &mask);
  sched_setaffinity(0, sizeof mask, &mask);
  while (!stop.stop_requested())
    std::this_thread::sleep_for(milliseconds(1));
}

}  // namespace

KernelTrial try_kernel_events(KernelSource& source, milliseconds length) {
  constexpr milliseconds kInterval{100};  // buffers are emptied at least so often
  std::vector<Counter> counters(source.cpus().size());
  std::vector<KernelEventSink*> sinks;
  sinks.reserve(counters.size());
  for (auto& counter : counters)
    sinks.push_back(&counter);
  const auto began = std::chrono::steady_clock::now();
  source.start();
  KernelReader reader(source, std::move(sinks), kInterval);
  reader.start();
  {
    std::vector<std::jthread> threads;
    threads.reserve(source.cpus().size());
    for (const auto cpu : source.cpus())
      threads.emplace_back(wake_often, cpu);
    std::this_thread::sleep_for(length);
  }
  source.stop();
  reader.stop();
  KernelTrial trial{.route = std::string(source.name()),
                    .length = std::chrono::steady_clock::now() - began,
                    .cpus = {}};
  for (std::size_t i = 0; i < counters.size(); ++i) {
    trial.cpus.push_back({.number = source.cpus()[i],
                          .switches = counters[i].check().switches(),
                          .untold = counters[i].check().untold(),
                          .lost = source.lost(i)});
  }
  return trial;
}

std::string kernel_trial_json(KernelRoute route, std::uint64_t buffer_size, milliseconds length) {
  Json json{{"schema", "cie.kernel-trial/1"}};
  try {
    const auto source = open_kernel_source(route, buffer_size);
    const auto trial = try_kernel_events(*source, length);
    json["route"] = trial.route;
    json["length_ns"] = trial.length.count();
    json["cpus"] = Json::array();
    for (const auto& cpu : trial.cpus) {
      json["cpus"].push_back({{"cpu", cpu.number},
                              {"switches", cpu.switches},
                              {"untold", cpu.untold},
                              {"lost", cpu.lost}});
    }
  } catch (const std::exception& error) {
    json["reason"] = error.what();
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace cie::record
