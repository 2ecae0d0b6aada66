// How trace_of() turns lines into events: the line, what the directives declare, and the writer,
// whose parts live in trace_line.cpp (words and values), trace_declarations.cpp (directives),
// trace_user_events.cpp, trace_state_events.cpp and trace_kernel_events.cpp (verbs) and
// trace_frame.cpp (what is added around them: registration, totals, streams and packets).
// For trace_*.cpp only; tests include trace_text.hpp.
#pragma once

#include "support/trace_text.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::test::text {

using namespace analysis;

constexpr std::int64_t kPrologue = -10'000;
constexpr StreamIndex kUser{0};
constexpr StreamIndex kKernel{1};

// A line cut into words, `key=value` pairs apart. Throws std::invalid_argument where it lacks what
// is asked of it.
struct Line {
  std::string text;
  std::vector<std::string> words;
  std::map<std::string, std::string, std::less<>> values;

  [[noreturn]] void fail(const std::string& why) const;
  const std::string& word(std::size_t i) const;
  bool has(std::string_view flag) const;
  std::int64_t parse(std::string_view digits) const;
  template <typename T = std::int64_t>
  T number(std::string_view key, std::int64_t fallback) const {
    const auto found = values.find(key);
    return static_cast<T>(found == values.end() ? fallback : parse(found->second));
  }
  std::string value(std::string_view key, std::string_view fallback) const;
  bool gives(std::string_view key) const { return values.contains(key); }
};

Line cut(std::string_view text);

template <typename Enum>
std::optional<Enum> from_label(std::string_view text) {
  for (std::size_t i = 0; i < Labels<Enum>::kValues.size(); ++i) {
    if (Labels<Enum>::kValues[i] == text) return static_cast<Enum>(i);
  }
  return std::nullopt;
}

struct Process {
  std::int64_t pid = 100;
  std::string executor = "isolated";
  std::string spec;  // its sha256
  std::int64_t from = kPrologue;
  std::int64_t cursor = kPrologue;  // where the next added event of the prologue goes
  std::optional<std::int64_t> until;
  std::int64_t ahead = 0;  // its clock, in a time namespace
  bool is_attached = false;
  bool has_crashed = false;
  std::uint32_t callbacks = 0;
  std::uint32_t groups = 0;
  std::uint32_t threads = 0;
  std::uint32_t publishers = 0;
};

struct Group {
  Process* process = nullptr;
  std::uint32_t id = 0;
  bool is_reentrant = false;
};

struct Thread {
  Process* process = nullptr;
  std::string name;
  std::int64_t tid = 0;
  std::int32_t cpu = 0;
  ThreadRole role = ThreadRole::callback;
  std::uint32_t callback = kNoId;
  std::uint32_t group = kNoId;
  bool is_silent = false;
  bool has_begin = false;
  bool has_finish = false;
  bool is_audited = false;  // at its end, because no line tells of its read-backs
  std::uint32_t read_backs = 0;
  std::int64_t start = 0;  // of its last thread_init that was not `again`
  std::int32_t prio = 120;
};

struct Callback {
  Process* process = nullptr;
  Group* group = nullptr;
  Thread* thread = nullptr;
  std::uint32_t id = 0;
  CallbackInit init;
  bool has_init = false;
  bool has_fini = false;
  std::uint64_t next = 0;
  std::optional<std::int64_t> release;
  std::vector<std::uint64_t> open;
  CallbackFini totals;
  std::uint64_t release_seq = 0;
};

struct Publisher {
  Process* process = nullptr;
  std::uint32_t id = 0;
  PublisherInit init;
  std::uint64_t next = 0;
  std::map<std::uint64_t, std::int64_t> written;  // source timestamps by seq
  std::uint64_t unsent = 0;
};

// A line and its time.
using TimedLine = std::pair<std::int64_t, Line>;

// Writes one trace: declarations first, then the verbs in order of time, then the frame.
class Writer {
 public:
  TextTrace write(std::string_view text);

 private:
  template <typename T>
  T& named(std::map<std::string, T, std::less<>>& all, const Line& line, const std::string& name) {
    const auto found = all.find(name);
    if (found == all.end()) line.fail("unknown name " + name);
    return found->second;
  }
  Process& process() {
    if (current_ == nullptr) current_ = &processes_.emplace_back();
    return *current_;
  }
  std::string_view keep(std::string text) { return trace_.strings->emplace_back(std::move(text)); }
  template <typename Body>
  void add(std::int64_t time, const EventHead& who, Body body) {
    auto head = who;
    head.time = {time};
    trace_.events.push_back(Event{.head = head, .body = body});
    last_ = std::max(last_, time);
  }
  static EventHead by(const Thread& thread) {
    return {.time = {},
            .stream = kUser,
            .cpu = thread.cpu,
            .pid = thread.process->pid,
            .tid = thread.tid};
  }
  static EventHead main_of(const Process& process) {
    return {.time = {}, .stream = kUser, .cpu = 0, .pid = process.pid, .tid = process.pid};
  }
  EventHead of_line(const Line& line, const Thread* fallback, const Process& process) {
    auto head = fallback != nullptr ? by(*fallback) : main_of(process);
    if (line.gives("on")) head = by(named(threads_, line, line.value("on", "")));
    if (line.gives("cpu")) head.cpu = line.number<std::int32_t>("cpu", 0);
    return head;
  }

  bool declare(const Line& line);
  void declare_callback(const Line& line);
  void declare_thread(const Line& line);
  void user_event(std::int64_t time, const Line& line);
  void start(std::int64_t time, const Line& line, Callback& callback);
  void end(std::int64_t time, const Line& line, Callback& callback);
  void publish(std::int64_t time, const Line& line);
  void read_back(std::int64_t time, const Line& line, Thread& thread, SchedMoment moment);
  bool state_event(std::int64_t time, const Line& line);
  bool kernel_event(std::int64_t time, const Line& line);
  bool recording_event(std::int64_t time, const Line& line);
  void switch_to(std::int64_t time, std::int32_t cpu, std::int64_t state, const Thread* next,
                 const Line& line);
  ThreadInit init_of(const Thread& thread);
  void thread_init(std::int64_t time, Thread& thread);
  void thread_fini(std::int64_t time, Thread& thread);
  RunBegin run_begin(const Process& process, std::int64_t time, const std::string& spec,
                     RunMoment moment);
  void prologue();
  void configure(Thread& thread, const std::vector<TimedLine>& lines);
  void epilogue();
  void frame();

  TextTrace trace_;
  std::deque<Process> processes_;
  Process* current_ = nullptr;
  std::map<std::string, Group, std::less<>> groups_;
  std::map<std::string, Thread, std::less<>> threads_;
  std::vector<std::string> thread_order_;
  std::map<std::string, Callback, std::less<>> callbacks_;
  std::vector<std::string> callback_order_;
  std::map<std::string, Publisher, std::less<>> publishers_;
  std::vector<std::string> publisher_order_;
  std::map<std::int32_t, const Thread*> on_cpu_;
  std::int64_t next_tid_ = 1;
  std::int64_t last_ = 0;
  bool has_kernel_ = false;
};

}  // namespace cie::test::text
