// Runs of a timer, and a spec of what they have to keep.
#pragma once

#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

namespace cie::test {

inline std::string spec(const std::string& bounds) {
  return "callback_groups:\n  - id: fusion\n    " + bounds + "\n";
}

// Response times 5 and 8, durations 3 and 6, inter-arrival time 10.
inline constexpr const char* kTwoRuns = R"(
  callback fusion timer period=10
  12 start fusion release=10
  15 end fusion
  22 start fusion release=20
  28 end fusion)";

inline void drop_first_instance(TextTrace& trace) {
  trace.erase<analysis::CallbackStart>(
      [](const analysis::CallbackStart& e, const analysis::EventHead&) { return e.seq == 0; });
  trace.erase<analysis::CallbackEnd>(
      [](const analysis::CallbackEnd& e, const analysis::EventHead&) { return e.seq == 0; });
}

// With the stream of another CPU in its channel, which begins and ends with the others where it is not said.
inline TextTrace beside_stream(TextTrace trace, std::optional<std::int64_t> begin,
                               std::optional<std::int64_t> end) {
  using namespace analysis;
  const auto first = *std::ranges::find_if(trace.events, [](const Event& event) {
    return event.head.stream == StreamIndex{0} && std::holds_alternative<StreamBegin>(event.body);
  });
  const auto last = trace.events.back().head.time.ns;
  const auto add = [&trace](std::int64_t time, const EventBody& body) {
    trace.events.push_back(
        {.head = {.time = {time}, .stream = StreamIndex{20}, .cpu = {}, .pid = {}, .tid = {}},
         .body = body});
  };
  const auto from = begin.value_or(first.head.time.ns);
  add(from, first.body);
  add(from, PacketBegin{});
  add(end.value_or(last), PacketEnd{});
  add(end.value_or(last), StreamEnd{});
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  return trace;
}

}  // namespace cie::test
