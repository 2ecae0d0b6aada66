#include "ros2_text.hpp"

#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/sentences.hpp>

#include "vocabulary/event_batch.hpp"
#include "vocabulary/ros2/event_translator.hpp"
#include "vocabulary/vocabulary.hpp"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace cie::analysis;

class Rows final : public Observer {
 public:
  std::vector<InstanceRow> rows;
  void on_instance(const Instance& instance) override {
    InstanceRow row;
    row.logical_id = instance.logical_id;
    row.start = instance.start.ns;
    if (instance.end) row.end = instance.end->ns;
    if (is_known(instance.release_source)) row.release = instance.release->ns;
    if (instance.wakeup) row.wakeup = instance.wakeup->ns;
    row.is_from_known_publisher = instance.writer_gid != 0;
    row.message = instance.source_timestamp_realtime_ns;
    row.missed = instance.missed;
    rows.push_back(row);
  }
  std::size_t publications = 0;
  void on_publication(const Publication& /*publication*/) override { ++publications; }
};

// A line's event, its fields where the vocabulary wants them.
class Line {
 public:
  explicit Line(const std::string& text) {
    std::istringstream words(text);
    std::string event;
    words >> time >> event;
    if (event.find(':') == std::string::npos) event = "ros2:" + event;
    is_kernel = event.starts_with("sched:");
    translation = find_translation(event);
    if (translation == nullptr) throw std::invalid_argument("no such event: " + text);
    fields_.resize(kMaxSlots);
    for (std::string word; words >> word;)
      take(word, text);
  }

  std::int64_t time = 0;
  std::int64_t pid = 1;
  std::int64_t tid = 1;
  std::int32_t cpu = 0;
  std::string boot;
  bool is_kernel = false;
  bool is_of_second_stream = false;
  bool is_of_second_session = false;
  const Translation* translation = nullptr;
  const Field* fields() const { return fields_.data(); }

 private:
  void take(const std::string& word, const std::string& text) {
    const auto equals = word.find('=');
    if (equals == std::string::npos) throw std::invalid_argument("no value in " + text);
    const auto name = word.substr(0, equals);
    const auto value = word.substr(equals + 1);
    if (name == "pid" || name == "tid") {
      (name == "pid" ? pid : tid) =
          std::stoll(value);  // the kernel's events have it as a field, too
    }
    if (name == "boot") {
      boot = value;
      return;
    }
    if (name == "cpu") {
      cpu = std::stoi(value);
      return;
    }
    if (name == "stream") {
      is_of_second_stream = value == "2";
      return;
    }
    if (name == "session") {
      is_of_second_session = value == "2";
      return;
    }
    for (std::size_t slot = 0; slot < translation->fields.size(); ++slot) {
      const auto& request = translation->fields[slot];
      if (!request.alternative(name)) continue;
      store(fields_[slot], value, name == "gid" || name == "client_gid" || name == "cpus");
      const auto label = std::ranges::find(request.labels, value);
      if (label == request.labels.end()) continue;
      fields_[slot].label = static_cast<std::int16_t>(label - request.labels.begin());
    }
  }
  void store(Field& field, const std::string& value, bool is_list) {
    const auto digit = value.find_first_not_of('-');
    if (is_list) {
      auto& list = lists_.emplace_back();
      std::istringstream elements(value);
      for (std::string element; std::getline(elements, element, '.');)
        list.push_back(static_cast<std::uint32_t>(std::stoul(element)));
      field.kind = Field::Kind::integers;
      field.elements = list.data();
      field.length = static_cast<std::uint32_t>(list.size());
      return;
    }
    const bool is_number = digit <= 1 && value[digit] >= '0' && value[digit] <= '9';
    if (is_number && value.find('.') == std::string::npos) {
      field.kind = Field::Kind::integer;
      field.length = 64;
      field.number = std::stoll(value, nullptr, 0);
      return;
    }
    texts_.push_back(value);
    field.kind = Field::Kind::text;
    field.characters = texts_.back().data();
    field.length = static_cast<std::uint32_t>(texts_.back().size());
  }

  std::vector<Field> fields_;
  std::deque<std::string> texts_;
  std::deque<std::vector<std::uint32_t>> lists_;
};

// CPUs of the kernel's events, each of which has a stream of its own.
std::vector<std::int32_t> kernel_cpus(std::string_view text) {
  std::set<std::int32_t> cpus;
  std::istringstream lines{std::string(text)};
  for (std::string line_text; std::getline(lines, line_text);) {
    if (line_text.find(" sched:") != std::string::npos) cpus.insert(Line(line_text).cpu);
  }
  return {cpus.begin(), cpus.end()};
}

// Boots of other machines, each of which has a stream.
std::vector<std::string> other_boots(std::string_view text) {
  std::set<std::string> boots;
  std::istringstream lines{std::string(text)};
  for (std::string line_text; std::getline(lines, line_text);) {
    if (line_text.find(" boot=") != std::string::npos) boots.insert(Line(line_text).boot);
  }
  return {boots.begin(), boots.end()};
}

// Batches hold so many events.
Ros2Result analyze(std::string_view text, std::int64_t lost_at, std::string_view spec_text,
                   std::size_t batch_size, std::optional<TimeWindow> window = {}) {
  Rows rows;
  std::size_t ended_at_once = 0;
  std::optional<SchedulingSpec> spec;
  AnalysisOptions options{.window = window};
  if (!spec_text.empty())
    options.spec = &spec.emplace(SchedulingSpec::parse(spec_text, "spec.yaml"));
  Analyzer analyzer(options, &rows);
  EventTranslator translator;
  EventBatch batch(batch_size);
  EventHead head{.time = {}, .stream = {}, .cpu = 0, .pid = {}, .tid = {}};
  const auto consume_batch = [&] {
    translator.observe(batch);
    batch.each([&](const Event& event) {
      const auto* start = std::get_if<CallbackStart>(&event.body);
      if (start != nullptr && start->end) ++ended_at_once;
      analyzer.consume(event);
    });
    batch.clear();
  };
  const auto add = [&](std::int64_t time) -> Event& {
    if (batch.is_full()) consume_batch();
    head.time = Timestamp{time};
    auto& event = batch.add();
    event.head = head;
    return event;
  };
  const auto consume = [&](std::int64_t time, const EventBody& body) {
    auto& event = add(time);
    event.body = body;
    batch.keep(event);
  };
  constexpr StreamIndex kSecondStream{2'000};
  std::vector<StreamIndex> streams{StreamIndex{}};  // of the applications
  if (text.find(" stream=2") != std::string_view::npos) streams.push_back(kSecondStream);
  const auto on_stream = [&](StreamIndex stream, std::int64_t time, const auto&... bodies) {
    const auto before = head;
    head.stream = stream;
    head.cpu = stream == kSecondStream ? 1 : 0;
    (consume(time, bodies), ...);
    head.stream = {};
    head.cpu = before.cpu;
  };
  const auto on_streams = [&](std::int64_t time, const auto&... bodies) {
    for (const auto stream : streams)
      on_stream(stream, time, bodies...);
  };
  const auto tells = [&text](const char* what) {
    return text.find(what) != std::string_view::npos;
  };
  constexpr const char* kRunsBegin = " session of runs until=";
  constexpr std::string_view kChunk =
      "archives/20261129T042623+0000-20261129T042624+0000-3/ust/uid/0/64-bit/ros2_0";
  const StreamBegin of_applications{.channel = 0,
                                    .trace = 0,
                                    .domain = Domain::user,
                                    .host = "robot",
                                    .clock_uuid = "boot",
                                    .clock_offset_ns = kRealtimeOffset,
                                    .path = tells(" second_ends of_chunk") ? kChunk : "stream",
                                    .has_events = true,
                                    .has_callback_events = !tells(kRunsBegin),
                                    .has_client_events = !tells(" no_client_events")};
  on_streams(0, of_applications);
  consume(0, PacketBegin{});
  if (streams.size() > 1 && !tells(" second_begins")) on_stream(kSecondStream, 0, PacketBegin{});
  constexpr StreamIndex kSecondSession{4'000};  // at the same time
  const bool has_second_session = tells(" session=2");
  const auto on_second_session = [&](std::int64_t time, const auto&... bodies) {
    if (has_second_session) on_stream(kSecondSession, time, bodies...);
  };
  auto second = of_applications;
  second.channel = second.trace = static_cast<std::uint32_t>(kSecondSession);
  second.has_client_events = true;
  on_second_session(0, second, PacketBegin{});
  constexpr StreamIndex kNextSession{3'000};
  if (tells(" session until=") || tells(kRunsBegin)) {
    auto next = of_applications;
    next.has_callback_events = next.has_client_events = true;
    next.channel = next.trace = static_cast<std::uint32_t>(kNextSession);
    on_stream(kNextSession, 0, next);
  }
  const auto cpus = kernel_cpus(text);
  const auto on_every_cpu = [&](std::int64_t time, const auto&... bodies) {
    for (std::size_t i = 0; i < cpus.size(); ++i) {
      head.stream = StreamIndex{static_cast<std::uint32_t>(1 + i)};
      head.cpu = cpus[i];
      (consume(time, bodies), ...);
    }
    head.stream = {};
  };
  on_every_cpu(0, StreamBegin{.channel = 1,
                              .domain = Domain::kernel,
                              .host = "robot",
                              .clock_uuid = "boot",
                              .clock_offset_ns = kRealtimeOffset,
                              .path = "kernel",
                              .has_inheritance = !tells(" kernel_without_inheritance")});
  if (!tells(" kernel_begins")) on_every_cpu(0, PacketBegin{});
  // A line that tells of the kernel's record.
  const auto is_of_record = [&](const std::string& line) {
    std::istringstream words(line);
    std::int64_t time = 0;
    std::string what;
    words >> time >> what;
    if (what == "kernel_begins") on_every_cpu(time, PacketBegin{});
    if (what == "kernel_ends") on_every_cpu(time, PacketEnd{}, StreamEnd{});
    if (what == "kernel_lost") {
      std::int64_t until = 0;
      words >> until;
      on_every_cpu(
          time,
          Discarded{
              .begin = Timestamp{time}, .end = Timestamp{until}, .count = 1, .packets = false});
    }
    return what.starts_with("kernel_") || what == "no_client_events";
  };
  constexpr std::uint32_t kFirstOther = 1'000;  // stream and channel of the first other machine
  const auto boots = other_boots(text);
  const auto on_other_machines = [&](std::int64_t time, const auto& consume_of) {
    for (std::uint32_t i = 0; i < boots.size(); ++i) {
      head.stream = StreamIndex{kFirstOther + i};
      consume_of(time, i);
    }
    head.stream = {};
  };
  on_other_machines(0, [&](std::int64_t time, std::uint32_t i) {
    consume(time, StreamBegin{.channel = kFirstOther + i,
                              .domain = Domain::user,
                              .host = "robot",
                              .clock_uuid = boots[i],
                              .clock_offset_ns = kRealtimeOffset,
                              .path = "other"});
    consume(time, PacketBegin{});
  });
  std::istringstream lines{std::string(text)};
  VocabularyState state;
  std::int64_t last = 0;
  for (std::string line_text; std::getline(lines, line_text);) {
    if (line_text.find_first_not_of(' ') == std::string::npos) continue;
    head.pid.reset();
    head.tid.reset();
    if (is_of_record(line_text)) continue;
    if (const auto at = line_text.find(" second_"); at != std::string::npos) {
      const auto time = std::stoll(line_text);
      if (line_text.substr(at) == " second_begins") {
        on_stream(kSecondStream, time, PacketBegin{});
      } else {
        on_stream(kSecondStream, time, PacketEnd{}, StreamEnd{});
        streams.pop_back();
      }
      continue;
    }
    std::int64_t lost_from = 0;
    std::int64_t lost_until = 0;
    // NOLINTNEXTLINE(cert-err34-c): a line of this file's tests
    if (std::sscanf(line_text.c_str(), "%ld lost until=%ld", &lost_from, &lost_until) == 2) {
      head = {.time = {}, .stream = {}, .cpu = head.cpu, .pid = {}, .tid = {}};
      if (line_text.find(" stream=2") != std::string::npos) head.stream = kSecondStream;
      std::optional<Timestamp> last_with_room;
      const std::string room = " room=";
      if (const auto at = line_text.find(room); at != std::string::npos)
        last_with_room = Timestamp{std::stoll(line_text.substr(at + room.size()))};
      consume(lost_from, Discarded{.begin = Timestamp{lost_from},
                                   .end = Timestamp{lost_until},
                                   .count = 1,
                                   .packets = false,
                                   .last_with_room = last_with_room});
      head.stream = {};
      continue;
    }
    // NOLINTNEXTLINE(cert-err34-c): as above
    if (std::sscanf(line_text.c_str(), "%ld session until=%ld", &lost_from, &lost_until) == 2 ||
        std::sscanf(line_text.c_str(), "%ld session of runs until=%ld", &lost_from, &lost_until) ==
            2) {
      on_streams(lost_from, PacketEnd{}, StreamEnd{});
      streams = {kNextSession};
      on_streams(lost_until, PacketBegin{});
      continue;
    }
    const Line line(line_text);
    if (line.time < last) throw std::invalid_argument("goes back in time: " + line_text);
    if (lost_at >= last && lost_at < line.time) {
      head.stream = {};
      head.pid.reset();
      head.tid.reset();
      consume(lost_at, Discarded{.begin = Timestamp{lost_at},
                                 .end = Timestamp{line.time},
                                 .count = 1,
                                 .packets = false});
    }
    last = line.time;
    head.pid = line.pid;
    head.tid = line.tid;
    head.cpu = line.cpu;
    const auto on = std::ranges::find(cpus, line.cpu) - cpus.begin();
    head.stream =
        line.is_kernel ? StreamIndex{static_cast<std::uint32_t>(1 + on)} : streams.front();
    if (line.is_of_second_stream) head.stream = kSecondStream;
    if (line.is_of_second_session) head.stream = kSecondSession;
    if (!line.boot.empty()) {
      const auto machine = std::ranges::find(boots, line.boot) - boots.begin();
      head.stream = StreamIndex{kFirstOther + static_cast<std::uint32_t>(machine)};
    }
    translate(add(line.time), *line.translation, Payload{line.fields()}, state, batch, &translator);
  }
  head.pid.reset();
  head.tid.reset();
  on_other_machines(last + 1, [&](std::int64_t time, std::uint32_t /*machine*/) {
    consume(time, PacketEnd{});
    consume(time, StreamEnd{});
  });
  if (!tells(" kernel_ends")) on_every_cpu(last + 1, PacketEnd{}, StreamEnd{});
  on_second_session(last + 1, PacketEnd{}, StreamEnd{});
  on_streams(last + 1, PacketEnd{}, StreamEnd{});
  consume_batch();
  translator.finish(batch);
  consume_batch();
  Ros2Result result{.analysis = analyzer.finish(),
                    .instances = std::move(rows.rows),
                    .ended_at_once = ended_at_once,
                    .publications = rows.publications};
  return result;
}

std::string told(const Ros2Result& result) {
  std::ostringstream text;
  viewer_export::write_report_json(text, result.analysis.report);
  viewer_export::write_verify_json(text, result.analysis.verdicts, result.analysis.report);
  for (const auto& row : result.instances) {
    text << row.logical_id << ' ' << row.start << ' ' << row.end << ' ' << row.release << ' '
         << row.wakeup << ' ' << row.is_from_known_publisher << '\n';
  }
  return text.str();
}

}  // namespace

// Where batches are as large as a reader's, starts tell of the ends that follow at once: that
// changes nothing.
std::string pair_of_period(std::int64_t period) {
  return R"(
  0 rcl_node_init pid=1 node_handle=0x10 node_name=a namespace=/
  0 rcl_publisher_init pid=1 publisher_handle=0x60 node_handle=0x10 topic_name=/t
  1 rcl_timer_init pid=1 timer_handle=0x20 period=)" +
         std::to_string(period) + R"(
  1 rclcpp_timer_callback_added pid=1 timer_handle=0x20 callback=0x30
  1 rclcpp_timer_link_node pid=1 timer_handle=0x20 node_handle=0x10
  2 rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/
  2 rcl_subscription_init pid=2 subscription_handle=0x20 node_handle=0x10 topic_name=/t queue_depth=1
  2 rclcpp_subscription_init pid=2 subscription_handle=0x20 subscription=0x40
  2 rclcpp_subscription_callback_added pid=2 subscription=0x40 callback=0x50
)";
}

Ros2Result analyze_ros2(std::string_view text, std::int64_t lost_at, std::string_view spec,
                        std::optional<TimeWindow> window) {
  constexpr std::size_t kOfReader = 256;
  auto result = analyze(text, lost_at, spec, kOfReader, window);
  EXPECT_EQ(told(result), told(analyze(text, lost_at, spec, 1, window)));
  const auto& trace = result.analysis.report.trace;
  if (trace.begin && trace.end) {
    const auto third = Duration{(trace.end->ns - trace.begin->ns) / 3};
    const TimeWindow middle{.from = *trace.begin + third, .to = *trace.end - third};
    EXPECT_EQ(told(analyze(text, lost_at, spec, kOfReader, middle)),
              told(analyze(text, lost_at, spec, 1, middle)));
  }
  std::ranges::stable_sort(result.instances, {}, &InstanceRow::start);
  return result;
}

std::string instance(int time, int prio, int cpu) {
  const auto at = [time](int offset) { return "\n" + std::to_string(time + offset) + ' '; };
  const auto on = " cpu=" + std::to_string(cpu);
  const auto priority = std::to_string(prio);
  return at(0) + "sched:sched_switch prev_tid=0 prev_prio=120 prev_state=0 next_tid=7 next_prio=" +
         priority + on + unswitched_instance(time, cpu) + at(3) +
         "sched:sched_switch prev_tid=7 prev_state=1 next_tid=0 next_prio=120 prev_prio=" +
         priority + on;
}

std::string unswitched_instance(int time, int cpu) {
  const auto at = [time](int offset) { return "\n" + std::to_string(time + offset) + ' '; };
  const auto thread = " callback=0x30 tid=7 cpu=" + std::to_string(cpu);
  return at(1) + "callback_start" + thread + at(2) + "callback_end" + thread;
}

std::string Ros2Result::durations() const {
  std::string text;
  for (const auto& callback : analysis.report.callbacks) {
    if (!callback.duration) continue;
    text += callback.logical_id + ": " + std::to_string(callback.duration->count) + " of " +
            std::to_string(callback.duration->min) + " to " +
            std::to_string(callback.duration->max) + "\n";
  }
  return text;
}

const CallbackReport& Ros2Result::callback(std::string_view logical_id) const {
  for (const auto& callback : analysis.report.callbacks) {
    if (callback.logical_id == logical_id) return callback;
  }
  throw std::out_of_range("no callback " + std::string(logical_id));
}

std::vector<std::string> Ros2Result::logical_ids() const {
  std::vector<std::string> ids;
  for (const auto& callback : analysis.report.callbacks)
    ids.push_back(callback.logical_id);
  return ids;
}

std::vector<std::string> Ros2Result::chains() const {
  std::vector<std::string> names;
  for (const auto& chain : analysis.report.chains)
    names.push_back(chain.name + ": " + std::to_string(chain.instances));
  return names;
}

Verdict Ros2Result::verdict(std::string_view rule) const {
  for (const auto& each : analysis.verdicts.rules) {
    if (each.id == rule) return each.verdict;
  }
  throw std::out_of_range("no rule " + std::string(rule));
}

std::string Ros2Result::evidence(std::string_view rule) const {
  std::string text;
  for (const auto& each : analysis.verdicts.rules) {
    if (each.id != rule) continue;
    for (const auto& subject : each.subjects) {
      for (const auto& item : subject.evidence)
        text +=
            subject.subject + ": " + item.event + ": " + viewer_export::sentence(item.note) + "\n";
    }
  }
  return text;
}

}  // namespace cie::test
