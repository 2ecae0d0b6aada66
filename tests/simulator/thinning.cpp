#include "simulator/thinning.hpp"

#include "support/laws.hpp"
#include "tape.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <vector>

namespace cie::sim {
namespace {

using namespace analysis;

class Thinner {
 public:
  Thinner(const test::TextTrace& trace, Random& random) : trace_(trace), random_(random) {}

  test::TextTrace run() {
    switch (random_.between(0, 4)) {
      case 0:
        some();
        break;
      case 1:
        of_a_kind();
        break;
      default:
        stretch();
        break;
    }
    return std::move(thin_);
  }

 private:
  void keep_unless(const std::function<bool(const Event&)>& is_victim) {
    thin_ = trace_;
    std::erase_if(thin_.events, [&](const Event& event) {
      return !test::is_structural(event) && is_victim(event);
    });
  }

  void some() {
    const auto rarity = random_.between(2, 200);
    keep_unless([&](const Event& event) { return !is_kernel(event) && random_.one_in(rarity); });
  }

  void of_a_kind() {
    const auto first = static_cast<Ns>(EventBody(RunBegin{}).index());
    const auto last = static_cast<Ns>(EventBody(ClockSync{}).index());
    const auto kind = static_cast<std::size_t>(random_.between(first, last));
    const auto rarity = random_.between(1, 4);
    keep_unless(
        [&](const Event& event) { return event.body.index() == kind && random_.one_in(rarity); });
  }

  // Everything of a time, in one stream or in all; recorded, or (not of the kernel's) silently.
  void stretch() {
    const auto begin = trace_.events.front().head.time.ns;
    const auto from = random_.between(std::max(begin, kBeginning), kBeginning + 30'000'000);
    const auto until = from + random_.between(0, random_.one_in(2) ? 500'000 : 10'000'000);
    const bool is_recorded = random_.one_in(2);
    const auto streams = static_cast<Ns>(streams_of().size());
    const auto only = streams_of().at(static_cast<std::size_t>(random_.between(0, streams - 1)));
    const bool is_of_all = random_.one_in(3);
    std::map<StreamIndex, std::uint64_t> lost;
    keep_unless([&](const Event& event) {
      const auto time = event.head.time.ns;
      if (time < from || time > until || !(is_of_all || event.head.stream == only)) return false;
      if (is_kernel(event) && !is_recorded) return false;
      ++lost[event.head.stream];
      return true;
    });
    if (!is_recorded) return;
    for (const auto& [stream, count] : lost)
      record(stream, from, until, count);
  }

  std::vector<StreamIndex> streams_of() const {
    std::vector<StreamIndex> streams;
    for (const auto& event : trace_.events) {
      if (std::holds_alternative<StreamBegin>(event.body)) streams.push_back(event.head.stream);
    }
    return streams;
  }

  void record(StreamIndex stream, Ns from, Ns until, std::uint64_t count) {
    const auto place = std::ranges::upper_bound(thin_.events, Timestamp{until}, {},
                                                [](const Event& e) { return e.head.time; });
    const bool is_packets = random_.one_in(3);
    thin_.events.insert(place, {.head = {.time = {until},
                                         .stream = stream,
                                         .cpu = std::nullopt,
                                         .pid = std::nullopt,
                                         .tid = std::nullopt},
                                .body = Discarded{.begin = {from},
                                                  .end = {until},
                                                  .count = is_packets ? 1 : count,
                                                  .packets = is_packets}});
  }

  const test::TextTrace& trace_;
  Random& random_;
  test::TextTrace thin_;
};

class KernelHoles {
 public:
  KernelHoles(const test::TextTrace& trace, Random& random, bool has_silent_ones)
      : trace_(trace), random_(random), has_silent_ones_(has_silent_ones) {
    for (const auto& event : trace_.events) {
      const auto* stream = std::get_if<StreamBegin>(&event.body);
      if (stream != nullptr && stream->domain == Domain::kernel) {
        streams_.push_back(event.head.stream);
      }
    }
  }

  test::TextTrace run() {
    if (streams_.empty()) return std::move(trace_);
    for (auto holes = random_.between(1, 4); holes > 0; --holes) {
      switch (random_.between(0, 5)) {
        case 0:
          remove_stream(any_stream());
          break;
        case 1:
          end_early(any_stream());
          break;
        case 2:
          if (has_silent_ones_) leave_out_switches();
          break;
        default:
          lose();
          break;
      }
    }
    return std::move(trace_);
  }

 private:
  StreamIndex any_stream() {
    const auto last = static_cast<Ns>(streams_.size()) - 1;
    return streams_[static_cast<std::size_t>(random_.between(0, last))];
  }
  Ns any_time() { return kBeginning + random_.between(0, 30'000'000); }

  void remove_stream(StreamIndex stream) {
    std::erase_if(trace_.events,
                  [stream](const Event& event) { return event.head.stream == stream; });
  }

  void end_early(StreamIndex stream) {
    const auto end = any_time();
    std::erase_if(trace_.events, [&](const Event& event) {
      return event.head.stream == stream && event.head.time.ns > end && !test::is_structural(event);
    });
    for (auto& event : trace_.events) {
      if (event.head.stream != stream) continue;
      if (event.head.time.ns > end) event.head.time = {end};
    }
    std::ranges::stable_sort(trace_.events, {}, [](const Event& e) { return e.head.time; });
  }

  void leave_out_switches() {
    const auto rarity = random_.between(2, 200);
    trace_.erase<SchedSwitch>(
        [&](const SchedSwitch&, const EventHead&) { return random_.one_in(rarity); });
  }

  void lose() {
    const auto from = any_time();
    const auto until = from + random_.between(0, random_.one_in(2) ? 500'000 : 5'000'000);
    const auto stream = any_stream();
    const auto lost =
        static_cast<std::uint64_t>(std::erase_if(trace_.events, [&](const Event& event) {
          const auto time = event.head.time.ns;
          return event.head.stream == stream && time >= from && time <= until &&
                 !test::is_structural(event);
        }));
    const bool is_of_packets = random_.one_in(3);
    EventBody loss = Discarded{.begin = {from},
                               .end = {until},
                               .count = is_of_packets ? 1 : lost,
                               .packets = is_of_packets};
    if (!is_of_packets && random_.one_in(3)) {
      loss = DamagedPacket{.reason = "cut", .begin = Timestamp{from}, .end = Timestamp{until}};
    }
    // A reader tells of a gap where it begins.
    const auto place = std::ranges::upper_bound(trace_.events, Timestamp{from}, {},
                                                [](const Event& e) { return e.head.time; });
    trace_.events.insert(place, {.head = {.time = {from},
                                          .stream = stream,
                                          .cpu = std::nullopt,
                                          .pid = std::nullopt,
                                          .tid = std::nullopt},
                                 .body = loss});
  }

  test::TextTrace trace_;
  Random& random_;
  bool has_silent_ones_;
  std::vector<StreamIndex> streams_;
};

}  // namespace

test::TextTrace with_kernel_holes(const test::TextTrace& trace, Random& random,
                                  bool has_silent_ones) {
  return KernelHoles(trace, random, has_silent_ones).run();
}

test::TextTrace thinned(const test::TextTrace& trace, Random& random) {
  return Thinner(trace, random).run();
}

}  // namespace cie::sim
