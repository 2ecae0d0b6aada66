#include "simulator/transform.hpp"

#include <algorithm>
#include <memory>
#include <set>
#include <tuple>
#include <utility>

namespace cie::sim {
namespace {

using namespace analysis;

// Changes what a body holds of times, threads, writers and channels.
class Changer {
 public:
  explicit Changer(const Change& change) : change_(change) {}

  template <typename Body>
  void operator()(Body& body) const {
    if constexpr (requires { body.tid; }) tid(body.tid);
    if constexpr (requires { body.begin.ns; }) body.begin.ns += change_.time;
    if constexpr (requires { body.end.ns; }) body.end.ns += change_.time;
    if constexpr (requires { body.start_ns; }) body.start_ns += change_.time;
    if constexpr (requires { body.monotonic_ns; }) body.monotonic_ns += change_.time;
    if constexpr (requires { body.realtime_ns; }) body.realtime_ns += change_.time;
    if constexpr (requires { body.channel; }) body.channel += change_.stream;
    if constexpr (requires { body.writer_gid; }) {
      if (body.writer_gid != 0) body.writer_gid += change_.writer;
    }
    if constexpr (requires { body.source_timestamp_realtime_ns; }) {
      if (body.source_timestamp_realtime_ns != 0) {
        body.source_timestamp_realtime_ns += change_.time;
      }
    }
  }
  void also(RunBegin& body) const {
    body.pid += static_cast<std::uint32_t>(change_.pid);
    body.process_start_ns += change_.time;
  }
  void also(CallbackStart& body) const {
    if (body.release_ns >= 0) body.release_ns += change_.time;
  }
  void also(SchedSwitch& body) const {
    tid(body.prev_tid);
    tid(body.next_tid);
  }
  void also(SchedProcessFork& body) const {
    for (auto* id : {&body.parent_tid, &body.child_tid})
      tid(*id);
  }
  void also(SchedMigrateTask& body) const {
    body.orig_cpu += change_.cpu;
    body.dest_cpu += change_.cpu;
  }
  void also(SchedWaking& body) const { cpu(body.target_cpu); }
  void also(SchedWakeup& body) const { cpu(body.target_cpu); }
  template <typename Body>
  void also(Body&) const {}

 private:
  template <typename Tid>
  void tid(Tid& number) const {
    if (number != 0) number += static_cast<Tid>(change_.pid);
  }
  void cpu(std::optional<std::int32_t>& number) const {
    if (number) *number += change_.cpu;
  }

  const Change& change_;
};

bool is_begin(const Event& event) {
  return std::holds_alternative<StreamBegin>(event.body) ||
         std::holds_alternative<PacketBegin>(event.body);
}
bool is_end(const Event& event) {
  return std::holds_alternative<StreamEnd>(event.body) ||
         std::holds_alternative<PacketEnd>(event.body);
}

}  // namespace

test::TextTrace changed(const test::TextTrace& trace, const Change& change) {
  auto copy = trace;
  const Changer changer(change);
  for (auto& event : copy.events) {
    auto& head = event.head;
    // A packet that begins at 0 covers whatever came before.
    if (!is_begin(event) || head.time.ns != 0) head.time.ns += change.time;
    head.stream = StreamIndex{static_cast<std::uint32_t>(head.stream) + change.stream};
    if (head.cpu) head.cpu = *head.cpu + change.cpu;
    if (head.pid) head.pid = *head.pid + change.pid;
    if (head.tid) head.tid = *head.tid + change.pid;
    std::visit(
        [&changer](auto& body) {
          changer(body);
          changer.also(body);
        },
        event.body);
    if (auto* read = std::get_if<ThreadSched>(&event.body); read != nullptr && change.cpu != 0) {
      auto& cpus = copy.cpus->emplace_back(read->cpus.begin(), read->cpus.end());
      for (auto& cpu : cpus)
        cpu += static_cast<std::uint32_t>(change.cpu);
      read->cpus = cpus;
    }
  }
  return copy;
}

test::TextTrace merged(const test::TextTrace& one, const test::TextTrace& other) {
  auto both = one;
  // What the events' views look at must live as long as they do.
  const auto owners = std::make_shared<std::pair<test::TextTrace, test::TextTrace>>(one, other);
  both.strings = {owners, owners->first.strings.get()};
  both.events.insert(both.events.end(), other.events.begin(), other.events.end());
  // One recording covers both from the first beginning to the last end.
  const auto time = [](const Event& event) { return event.head.time; };
  const auto begin = std::ranges::min_element(both.events, {}, time)->head.time;
  const auto end = std::ranges::max_element(both.events, {}, time)->head.time;
  std::set<std::pair<StreamIndex, std::size_t>> edges;
  std::erase_if(both.events, [&edges](const Event& event) {
    const bool is_edge = is_begin(event) || is_end(event);
    return is_edge && !edges.emplace(event.head.stream, event.body.index()).second;
  });
  for (auto& event : both.events) {
    if (is_begin(event)) event.head.time = begin;
    if (is_end(event)) event.head.time = end;
  }
  std::ranges::stable_sort(both.events, {}, [](const Event& event) {
    const int place = is_end(event) ? 2 : is_begin(event) ? 0 : 1;
    return std::tuple(event.head.time, place);
  });
  return both;
}

}  // namespace cie::sim
