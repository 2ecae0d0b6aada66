#include "simulator/tape.hpp"

#include "random.hpp"

#include <algorithm>
#include <tuple>

namespace cie::sim {
namespace {

using namespace analysis;

bool is_state(const Event& event) {
  const auto category = analysis::category_of(event.body);
  return category == analysis::EventCategory::structure ||
         category == analysis::EventCategory::state;
}

// A stream: who writes it. Kernel streams have no process.
struct Key {
  Domain domain = Domain::user;
  bool is_state = false;
  std::int64_t pid = 0;
  std::int32_t cpu = 0;
  friend auto operator<=>(const Key&, const Key&) = default;
};

Key key_of(const Event& event, const Recording& recording) {
  if (is_kernel(event)) {
    return {.domain = Domain::kernel, .is_state = false, .pid = 0, .cpu = *event.head.cpu};
  }
  return {.domain = Domain::user,
          .is_state = is_state(event),
          .pid = recording.is_by_process ? *event.head.pid : 0,
          .cpu = *event.head.cpu};
}

struct Edges {
  Ns begin = 0;
  Ns end = 0;
};

Edges edges_of(const Key& key, const Recording& recording, Ns last) {
  if (key.domain == Domain::kernel) {
    return {.begin = recording.kernel_begin,
            .end = recording.kernel_end != 0 ? recording.kernel_end : last + 1};
  }
  const auto cpu = static_cast<std::size_t>(key.cpu);
  return {.begin = recording.user_begin.empty() ? 0 : recording.user_begin[cpu],
          .end = recording.user_end.empty() ? last + 1 : recording.user_end[cpu]};
}

bool is_recorded(const Event& event, const Recording& recording) {
  if (!is_kernel(event)) return true;
  return recording.has_kernel &&
         (recording.has_wakings || !std::holds_alternative<SchedWaking>(event.body));
}

// Every stream of a recording.
std::vector<Key> keys_of(const std::vector<Event>& events, const Recording& recording,
                         std::int32_t processors) {
  std::vector<Key> keys;
  for (const auto& event : events) {
    if (!is_recorded(event, recording)) continue;
    auto key = key_of(event, recording);
    key.cpu = 0;
    if (std::ranges::find(keys, key) != keys.end()) continue;
    for (; key.cpu < processors; ++key.cpu)  // each has a stream, even if nothing happens there
      keys.push_back(key);
  }
  return keys;
}

// Numbers streams in an order drawn from the seed, and channels within them.
std::map<Key, std::uint32_t> numbered(const std::vector<Key>& keys, std::uint64_t order) {
  auto shuffled = keys;
  Random random(order);
  for (std::size_t i = shuffled.size(); i > 1; --i) {
    std::swap(shuffled[i - 1],
              shuffled[static_cast<std::size_t>(random.between(0, static_cast<Ns>(i) - 1))]);
  }
  std::map<Key, std::uint32_t> numbers;
  for (const auto& key : shuffled)
    numbers.emplace(key, static_cast<std::uint32_t>(numbers.size()));
  return numbers;
}

std::uint32_t channel_of(const Key& key, const std::vector<Key>& keys) {
  const auto is_channel = [&key](const Key& other) {
    return std::tie(other.domain, other.is_state, other.pid) ==
           std::tie(key.domain, key.is_state, key.pid);
  };
  return static_cast<std::uint32_t>(std::ranges::find_if(keys, is_channel) - keys.begin());
}

// As a reader merges them: by time, then stream by stream; a packet's edge outside of its events.
void merge(test::TextTrace& trace) {
  const auto place = [](const Event& event) {
    if (std::holds_alternative<StreamBegin>(event.body)) return 0;
    if (std::holds_alternative<PacketBegin>(event.body)) return 1;
    if (std::holds_alternative<PacketEnd>(event.body)) return 3;
    return std::holds_alternative<StreamEnd>(event.body) ? 4 : 2;
  };
  std::ranges::stable_sort(trace.events, {}, [&place](const Event& event) {
    return std::tuple(event.head.time, place(event), event.head.stream);
  });
}

}  // namespace

bool is_kernel(const Event& event) {
  const auto index = event.body.index();
  return index >= EventBody(SchedSwitch{}).index() && index <= EventBody(SchedPiSetprio{}).index();
}

Tape::Tape(int cpus)
    : processors_(cpus),
      strings_(std::make_shared<std::deque<std::string>>()),
      cpus_(std::make_shared<std::deque<std::vector<std::uint32_t>>>()) {}

void Tape::user(Ns time, std::int32_t cpu, std::int64_t pid, std::int64_t tid,
                const EventBody& body) {
  events_.push_back(
      {.head = {.time = {time}, .stream = {}, .cpu = cpu, .pid = pid, .tid = tid}, .body = body});
}

void Tape::kernel(Ns time, std::int32_t cpu, const EventBody& body) {
  events_.push_back(
      {.head = {.time = {time}, .stream = {}, .cpu = cpu, .pid = std::nullopt, .tid = std::nullopt},
       .body = body});
}

test::TextTrace Tape::trace(const Recording& recording) const {
  test::TextTrace trace;
  trace.strings = strings_;
  trace.cpus = cpus_;
  auto keys = keys_of(events_, recording, processors_);
  std::ranges::sort(keys);
  const auto numbers = numbered(keys, recording.order);
  const auto edge = [&](const Key& key, Ns time, const EventBody& body) {
    trace.events.push_back({.head = {.time = {time},
                                     .stream = StreamIndex{numbers.at(key)},
                                     .cpu = key.cpu,
                                     .pid = std::nullopt,
                                     .tid = std::nullopt},
                            .body = body});
  };
  for (const auto& key : keys) {
    edge(key, 0,
         StreamBegin{.channel = channel_of(key, keys),
                     .domain = key.domain,
                     .host = "robot",
                     .clock_uuid = "boot",
                     .clock_offset_ns = kRealtimeOffset,
                     .path = key.domain == Domain::kernel ? "kernel" : "ust"});
    edge(key, edges_of(key, recording, end()).begin, PacketBegin{});
  }
  for (auto event : events_) {
    if (!is_recorded(event, recording)) continue;
    const auto key = key_of(event, recording);
    const auto edges = edges_of(key, recording, end());
    if (event.head.time.ns < edges.begin || event.head.time.ns > edges.end) continue;
    event.head.stream = StreamIndex{numbers.at(key)};
    trace.events.push_back(event);
  }
  for (const auto& key : keys) {
    const auto last = edges_of(key, recording, end()).end;
    edge(key, last, PacketEnd{});
    edge(key, last, StreamEnd{});
  }
  merge(trace);
  return trace;
}

}  // namespace cie::sim
