#include "support/move_to_host.hpp"

#include <algorithm>
#include <iterator>
#include <set>

namespace cie::test {
namespace {

using namespace analysis;

constexpr StreamIndex kOther{2};  // after trace_of()'s two

// Shifts what is told of the clocks by events of the host.
class Shift {
 public:
  explicit Shift(const OtherHost& host) : host_(host) {}

  void operator()(RunBegin& event) const {
    event.monotonic_ns += host_.monotonic;
    event.realtime_ns += host_.realtime;
    event.process_start_ns += host_.monotonic;
  }
  void operator()(ClockSync& event) const {
    event.monotonic_ns += host_.monotonic;
    event.realtime_ns += host_.realtime;
  }
  void operator()(ThreadInit& event) const { event.start_ns += host_.monotonic; }
  void operator()(CallbackStart& event) const {
    if (event.release_ns >= 0) event.release_ns += host_.monotonic;
  }
  void operator()(Publish& event) const { event.source_timestamp_realtime_ns += host_.realtime; }
  template <typename Other>
  void operator()(Other& /*event*/) const {}

 private:
  const OtherHost& host_;
};

}  // namespace

TextTrace beside(const TextTrace& trace, const TextTrace& other, const OtherHost& host) {
  constexpr std::uint64_t kOtherWriters = 1'000'000'000;
  TextTrace both = trace;
  both.more.insert(both.more.end(), {other.strings, other.cpus});
  const std::string_view name = both.strings->emplace_back(host.name);
  std::uint32_t streams = 0;  // no fewer than channels
  for (const auto& event : trace.events)
    streams = std::max(streams, static_cast<std::uint32_t>(event.head.stream) + 1);
  const StreamIndex first_of_theirs{streams};
  std::vector<Event> theirs = other.events;
  for (auto& event : theirs) {
    event.head.stream = StreamIndex{static_cast<std::uint32_t>(event.head.stream) + streams};
    if (auto* begin = std::get_if<StreamBegin>(&event.body)) {
      begin->channel += streams;
      begin->host = name;
      begin->clock_uuid = name;
      begin->clock_offset_ns += host.realtime - host.monotonic;
    }
    if (auto* run = std::get_if<RunBegin>(&event.body)) run->host = name;
    if (auto* publisher = std::get_if<PublisherInit>(&event.body))
      publisher->writer_gid += kOtherWriters;
    if (auto* start = std::get_if<CallbackStart>(&event.body); start && start->writer_gid != 0) {
      start->writer_gid += kOtherWriters;
      start->source_timestamp_realtime_ns += host.realtime;
    }
  }
  // In order of true time.
  std::vector<Event> all;
  std::ranges::merge(
      both.events, theirs, std::back_inserter(all), {},
      [](const Event& event) { return event.head.time; },
      [](const Event& event) { return event.head.time; });
  for (auto& event : all) {
    if (event.head.stream < first_of_theirs) continue;
    event.head.time.ns += host.monotonic;
    std::visit(Shift(host), event.body);
  }
  both.events = std::move(all);
  return both;
}

void move_to_host(TextTrace& trace, std::int64_t pid, const OtherHost& host) {
  const std::string_view name = trace.strings->emplace_back(host.name);
  std::set<std::uint64_t> writers;  // of the process
  for (auto& event : trace.events) {
    if (event.head.pid != pid) continue;
    if (const auto* publisher = std::get_if<PublisherInit>(&event.body))
      writers.insert(publisher->writer_gid);
    if (auto* run = std::get_if<RunBegin>(&event.body)) run->host = name;
    event.head.stream = kOther;
    event.head.time.ns += host.monotonic;
    std::visit(Shift(host), event.body);
  }
  for (auto& event : trace.events) {
    auto* start = std::get_if<CallbackStart>(&event.body);
    if (start != nullptr && writers.contains(start->writer_gid))
      start->source_timestamp_realtime_ns += host.realtime;
  }
  // Its own stream, with the bounds of the other one.
  std::vector<Event> all;
  for (const auto& event : trace.events) {
    all.push_back(event);
    if (event.head.stream != StreamIndex{0} || event.head.pid) continue;
    auto copy = event;
    copy.head.stream = kOther;
    copy.head.time.ns += host.monotonic;
    if (auto* begin = std::get_if<StreamBegin>(&copy.body)) {
      begin->channel = static_cast<std::uint32_t>(kOther);
      begin->host = name;
      begin->clock_uuid = name;
      begin->clock_offset_ns += host.realtime - host.monotonic;
    }
    all.push_back(copy);
  }
  trace.events = std::move(all);
}

}  // namespace cie::test
