#include "support/trace_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

namespace cie::test {
namespace {

using namespace analysis;

constexpr std::int64_t kPrologue = -10'000;
constexpr StreamIndex kUser{0};
constexpr StreamIndex kKernel{1};

// A line cut into words, `key=value` pairs apart.
struct Line {
  std::string text;
  std::vector<std::string> words;
  std::map<std::string, std::string, std::less<>> values;

  [[noreturn]] void fail(const std::string& why) const {
    throw std::invalid_argument(why + " in trace line: " + text);
  }
  const std::string& word(std::size_t i) const {
    if (i >= words.size()) fail("a word is missing");
    return words[i];
  }
  bool has(std::string_view flag) const {
    return std::find(words.begin(), words.end(), flag) != words.end();
  }
  std::int64_t parse(std::string_view digits) const {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc{} || end != digits.data() + digits.size()) fail("not a number");
    return value;
  }
  template <typename T = std::int64_t>
  T number(std::string_view key, std::int64_t fallback) const {
    const auto found = values.find(key);
    return static_cast<T>(found == values.end() ? fallback : parse(found->second));
  }
  std::string value(std::string_view key, std::string_view fallback) const {
    const auto found = values.find(key);
    return found == values.end() ? std::string(fallback) : found->second;
  }
  bool gives(std::string_view key) const { return values.contains(key); }
};

Line cut(std::string_view text) {
  Line line{.text = std::string(text), .words = {}, .values = {}};
  std::size_t begin = 0;
  while ((begin = text.find_first_not_of(" \t", begin)) != std::string_view::npos) {
    const auto end = std::min(text.find_first_of(" \t", begin), text.size());
    const auto word = text.substr(begin, end - begin);
    const auto equals = word.find('=');
    if (equals == std::string_view::npos) {
      line.words.emplace_back(word);
    } else {
      line.values.emplace(word.substr(0, equals), word.substr(equals + 1));
    }
    begin = end;
  }
  return line;
}

struct Process {
  std::int64_t pid = 100;
  std::string executor = "isolated";
  std::int64_t from = kPrologue;
  std::int64_t cursor = kPrologue;  // where the next added event of the prologue goes
  std::optional<std::int64_t> until;
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
};

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
  void thread_init(std::int64_t time, Thread& thread);
  void thread_fini(std::int64_t time, Thread& thread);
  void prologue();
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

template <typename Enum>
std::optional<Enum> from_label(std::string_view text) {
  for (std::size_t i = 0; i < Labels<Enum>::kValues.size(); ++i) {
    if (Labels<Enum>::kValues[i] == text) return static_cast<Enum>(i);
  }
  return std::nullopt;
}

void Writer::declare_callback(const Line& line) {
  const auto& name = line.word(1);
  auto& owner = process();
  auto& callback = callbacks_[name];
  callback_order_.push_back(name);
  callback.process = &owner;
  callback.id = owner.callbacks++;
  const auto group_name = line.value("group", "group of " + name);
  auto& group = groups_[group_name];
  if (group.process == nullptr) group = {.process = &owner, .id = owner.groups++};
  callback.group = &group;
  auto kind = CallbackKind::timer;
  for (const auto& word : line.words)
    kind = from_label<CallbackKind>(word).value_or(kind);
  callback.next = line.number<std::uint64_t>("next", 0);
  callback.init = CallbackInit{
      .callback = CallbackId{callback.id},
      .group = GroupId{group.id},
      .node = NodeId{0},
      .kind = kind,
      .logical_id = keep(line.value("id", name)),
      .source = keep(line.value("topic", "")),
      .symbol = keep("app::" + name),
      .period_ns = line.number<std::uint64_t>("period", kind == CallbackKind::timer ? 10 : 0),
      .queue_depth = 1,
      .deadline_ns = line.number<std::uint64_t>("deadline", 0),
      .next_seq = callback.next};
  callback.totals.callback = CallbackId{callback.id};
  callback.totals.started = callback.totals.ended = callback.next;
  if (line.has("pooled")) return;
  auto& thread = threads_[name];
  thread_order_.push_back(name);
  thread = {.process = &owner,
            .name = name,
            .tid = owner.pid + next_tid_++,
            .cpu = line.number<std::int32_t>("cpu", 0),
            .role = ThreadRole::callback,
            .callback = callback.id,
            .group = group.id};
  callback.thread = &thread;
}

void Writer::declare_thread(const Line& line) {
  const auto& name = line.word(1);
  auto& owner = process();
  auto& thread = threads_[name];
  thread_order_.push_back(name);
  thread.process = &owner;
  thread.name = name;
  thread.tid = line.number("tid", owner.pid + next_tid_++);
  thread.cpu = line.number<std::int32_t>("cpu", 0);
  thread.role = from_label<ThreadRole>(line.word(2)).value_or(ThreadRole::worker);
  thread.is_silent = line.has("silent");
  if (line.gives("of")) {
    const auto& callback = named(callbacks_, line, line.value("of", ""));
    thread.callback = callback.id;
    thread.group = callback.group->id;
  }
}

bool Writer::declare(const Line& line) {
  const auto& what = line.word(0);
  if (what == "process") {
    current_ = &processes_.emplace_back();
    current_->pid = line.number("pid", 100);
    current_->executor = line.value("executor", "isolated");
    current_->from = line.number("from", kPrologue);
    if (line.gives("until")) current_->until = line.number("until", 0);
    current_->is_attached = line.has("attached");
    current_->has_crashed = line.has("crash");
  } else if (what == "callback") {
    declare_callback(line);
  } else if (what == "group") {
    auto& owner = process();
    groups_[line.word(1)] = {
        .process = &owner, .id = owner.groups++, .is_reentrant = line.has("reentrant")};
  } else if (what == "thread") {
    declare_thread(line);
  } else if (what == "publisher") {
    auto& owner = process();
    auto& publisher = publishers_[line.word(1)];
    publisher_order_.push_back(line.word(1));
    publisher.process = &owner;
    publisher.id = owner.publishers++;
    publisher.next = line.number<std::uint64_t>("next", 0);
    publisher.init = {.publisher = PublisherId{publisher.id},
                      .node = NodeId{0},
                      .topic = keep(line.value("topic", "/" + line.word(1))),
                      .writer_gid = static_cast<std::uint64_t>(owner.pid) * 1000 + publisher.id + 1,
                      .next_seq = publisher.next};
  } else if (what == "kernel") {
    has_kernel_ = true;
  } else {
    return false;
  }
  return true;
}

void Writer::start(std::int64_t time, const Line& line, Callback& callback) {
  CallbackStart event;
  event.callback = CallbackId{callback.id};
  event.seq = line.number<std::uint64_t>("seq", static_cast<std::int64_t>(callback.next));
  callback.next = event.seq + 1;
  event.missed = line.number<std::uint32_t>("missed", 0);
  const auto kind =
      callback.init.kind == CallbackKind::timer ? ReleaseKind::timer : ReleaseKind::data;
  event.release_kind = ReleaseKind::none;
  if (line.value("release", "") == "none") {
    callback.release.reset();
  } else if (line.gives("release")) {
    callback.release = line.number("release", 0);
  }
  if (callback.release) {
    event.release_kind = kind;
    event.release_ns = *callback.release;
    callback.release.reset();
  }
  if (line.gives("from")) {
    const auto from = line.value("from", "");
    const auto colon = from.find(':');
    if (colon == std::string::npos) line.fail("from=P:SEQ");
    const auto& publisher = named(publishers_, line, from.substr(0, colon));
    const auto seq = static_cast<std::uint64_t>(line.parse(from.substr(colon + 1)));
    event.writer_gid = publisher.init.writer_gid;
    event.source_timestamp_realtime_ns = publisher.written.at(seq);
  }
  callback.open.push_back(event.seq);
  ++callback.totals.started;
  add(time, of_line(line, callback.thread, *callback.process), event);
}

void Writer::end(std::int64_t time, const Line& line, Callback& callback) {
  auto& open = callback.open;
  const auto fallback = open.empty() ? callback.next - 1 : open.front();
  const auto seq = line.number<std::uint64_t>("seq", static_cast<std::int64_t>(fallback));
  std::erase(open, seq);
  if (seq >= callback.init.next_seq) ++callback.totals.ended;  // earlier ones are counted
  add(time, of_line(line, callback.thread, *callback.process),
      CallbackEnd{
          .callback = CallbackId{callback.id},
          .seq = seq,
          .status = line.has("exception") ? CallbackStatus::exception : CallbackStatus::ok});
}

void Writer::publish(std::int64_t time, const Line& line) {
  auto& publisher = named(publishers_, line, line.word(2));
  const auto seq = line.number<std::uint64_t>("seq", static_cast<std::int64_t>(publisher.next));
  publisher.next = seq + 1;
  const auto stamp = 1'000'000'000 + time;
  publisher.written[seq] = stamp;
  add(time, of_line(line, nullptr, *publisher.process),
      Publish{.publisher = PublisherId{publisher.id},
              .seq = seq,
              .source_timestamp_realtime_ns = stamp});
}

void Writer::read_back(std::int64_t time, const Line& line, Thread& thread, SchedMoment moment) {
  static const std::map<std::string, std::int32_t, std::less<>> policies{
      {"other", 0}, {"fifo", 1}, {"rr", 2}, {"batch", 3}, {"idle", 5}, {"deadline", 6}};
  const auto policy = policies.find(line.value("policy", "other"));
  if (policy == policies.end()) line.fail("unknown policy");
  auto& cpus = trace_.cpus->emplace_back();
  std::string_view list = trace_.strings->emplace_back(line.value("cpus", "0,1"));
  while (!list.empty()) {
    const auto comma = std::min(list.find(','), list.size());
    cpus.push_back(static_cast<std::uint32_t>(line.parse(list.substr(0, comma))));
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  ThreadSched event{.tid = static_cast<std::uint32_t>(thread.tid),
                    .moment = moment,
                    .n = line.number<std::uint32_t>("n", thread.read_backs),
                    .policy = policy->second,
                    .flags = 1,
                    .nice = line.number<std::int32_t>("nice", 0),
                    .priority = line.number<std::uint32_t>("priority", 0),
                    .runtime_ns = line.number<std::uint64_t>("runtime", 0),
                    .deadline_ns = line.number<std::uint64_t>("deadline", 0),
                    .period_ns = line.number<std::uint64_t>("period", 0),
                    .cpus = cpus,
                    .error = line.number<std::int32_t>("error", 0)};
  thread.read_backs = event.n + 1;
  if (moment == SchedMoment::applied) {
    thread.prio = event.policy == 6     ? -1
                  : event.priority != 0 ? 99 - static_cast<std::int32_t>(event.priority)
                                        : 120 + event.nice;
  }
  add(time, by(thread), event);
}

bool Writer::state_event(std::int64_t time, const Line& line) {
  const auto& verb = line.word(1);
  if (const auto moment = from_label<SchedMoment>(verb)) {
    read_back(time, line, named(threads_, line, line.word(2)), *moment);
  } else if (verb == "begin") {
    auto& thread = named(threads_, line, line.word(2));
    thread.has_begin = true;
    thread_init(time, thread);
  } else if (verb == "finish") {
    auto& thread = named(threads_, line, line.word(2));
    thread.has_finish = true;
    thread_fini(time, thread);
  } else if (verb == "init") {
    auto& callback = named(callbacks_, line, line.word(2));
    callback.has_init = true;
    auto init = callback.init;
    init.next_seq = callback.next;
    add(time, main_of(*callback.process), init);
  } else if (verb == "fini") {
    auto& callback = named(callbacks_, line, line.word(2));
    callback.has_fini = true;
    add(time, main_of(*callback.process), callback.totals);
  } else {
    return false;
  }
  return true;
}

void Writer::user_event(std::int64_t time, const Line& line) {
  const auto& verb = line.word(1);
  if (verb == "publish") {
    publish(time, line);
    return;
  }
  auto& callback = named(callbacks_, line, line.word(2));
  const auto head = of_line(line, callback.thread, *callback.process);
  if (verb == "start") {
    start(time, line, callback);
  } else if (verb == "end") {
    end(time, line, callback);
  } else if (verb == "wakeup") {
    callback.release = time;
    add(time, head,
        ThreadWakeup{.callback = CallbackId{callback.id}, .reason = WakeupReason::data});
  } else if (verb == "release") {
    callback.release = time;
    callback.totals.overwritten = line.number<std::uint64_t>(
        "overwritten", static_cast<std::int64_t>(callback.totals.overwritten));
    ++callback.totals.released;
    add(time, main_of(*callback.process),
        CallbackRelease{.callback = CallbackId{callback.id},
                        .release_seq = callback.release_seq++,
                        .overwritten = callback.totals.overwritten});
  } else if (verb == "lost") {
    const auto count = line.number<std::uint32_t>("count", 1);
    callback.totals.lost += count;
    add(time, main_of(*callback.process),
        SampleLost{
            .callback = CallbackId{callback.id}, .count = count, .total = callback.totals.lost});
  } else {
    line.fail("unknown verb " + verb);
  }
}

void Writer::switch_to(std::int64_t time, std::int32_t cpu, std::int64_t state, const Thread* next,
                       const Line& line) {
  const auto* prev = on_cpu_[cpu];
  const auto prio = [](const Thread* thread) { return thread == nullptr ? 120 : thread->prio; };
  const auto name = [](const Thread* thread) {
    return thread == nullptr ? std::string_view("swapper") : std::string_view(thread->name);
  };
  add(time, {.time = {}, .stream = kKernel, .cpu = cpu, .pid = std::nullopt, .tid = std::nullopt},
      SchedSwitch{.prev_comm = keep(std::string(name(prev))),
                  .prev_tid = prev == nullptr ? 0 : prev->tid,
                  .prev_prio = line.number<std::int32_t>("prio", prio(prev)),
                  .prev_state = prev == nullptr ? 0 : state,
                  .next_comm = keep(std::string(name(next))),
                  .next_tid = next == nullptr ? 0 : next->tid,
                  .next_prio = line.number<std::int32_t>("next_prio", prio(next))});
  on_cpu_[cpu] = next;
}

bool Writer::kernel_event(std::int64_t time, const Line& line) {
  const auto& verb = line.word(1);
  const EventHead head{
      .time = {}, .stream = kKernel, .cpu = 0, .pid = std::nullopt, .tid = std::nullopt};
  const auto thread = [&](std::size_t i) -> const Thread* {
    return line.word(i) == "idle" ? nullptr : &named(threads_, line, line.word(i));
  };
  if (verb == "switch") {
    const auto cpu = static_cast<std::int32_t>(line.parse(line.word(2)));
    on_cpu_[cpu] = thread(3);
    switch_to(time, cpu, line.number("state", 1), thread(4), line);
  } else if (verb == "preempt") {
    const auto& by = named(threads_, line, line.value("by", ""));
    on_cpu_[thread(2)->cpu] = thread(2);
    switch_to(time, thread(2)->cpu, 0x100, &by, line);
  } else if (verb == "block") {
    on_cpu_[thread(2)->cpu] = thread(2);
    switch_to(time, thread(2)->cpu, 1, nullptr, line);
  } else if (verb == "resume") {
    switch_to(time, thread(2)->cpu, 1, thread(2), line);
  } else if (verb == "waking") {
    add(time, head, SchedWaking{.tid = thread(2)->tid, .prio = thread(2)->prio, .target_cpu = 0});
  } else if (verb == "fork") {
    add(time, head,
        SchedProcessFork{.parent_tid = thread(2)->tid,
                         .parent_pid = thread(2)->process->pid,
                         .child_tid = thread(3)->tid,
                         .child_pid = thread(3)->process->pid,
                         .child_comm = keep(thread(3)->name)});
  } else if (verb == "exit") {
    add(time, head, SchedProcessExit{.tid = thread(2)->tid});
  } else if (verb == "boost") {
    add(time, head,
        SchedPiSetprio{.tid = thread(2)->tid,
                       .old_prio = thread(2)->prio,
                       .new_prio = line.number<std::int32_t>("prio", 0)});
  } else {
    return false;
  }
  has_kernel_ = true;
  return true;
}

bool Writer::recording_event(std::int64_t time, const Line& line) {
  const auto& verb = line.word(1);
  const bool is_kernel = line.has("kernel");
  const EventHead head{.time = {},
                       .stream = is_kernel ? kKernel : kUser,
                       .cpu = 0,
                       .pid = std::nullopt,
                       .tid = std::nullopt};
  if (verb == "discard") {
    Discarded event{.begin = {time},
                    .end = {line.number("until", time)},
                    .count = std::nullopt,
                    .packets = line.has("packets")};
    if (line.gives("count")) event.count = line.number<std::uint64_t>("count", 0);
    add(event.end.ns, head, event);
  } else if (verb == "damage") {
    add(time, head, DamagedPacket{.reason = "cut short"});
  } else if (verb == "regress") {
    add(time, head, TimeRegression{.previous = {line.number("previous", time + 1)}});
  } else {
    return false;
  }
  has_kernel_ = has_kernel_ || is_kernel;
  return true;
}

void Writer::thread_init(std::int64_t time, Thread& thread) {
  add(time, by(thread),
      ThreadInit{.tid = static_cast<std::uint32_t>(thread.tid),
                 .role = thread.role,
                 .callback = CallbackId{thread.callback},
                 .group = GroupId{thread.group},
                 .name = keep(thread.name),
                 .start_ns = time});
  ++thread.process->threads;
}

void Writer::thread_fini(std::int64_t time, Thread& thread) {
  add(time, by(thread),
      ThreadFini{.tid = static_cast<std::uint32_t>(thread.tid), .read_backs = thread.read_backs});
}

void Writer::prologue() {
  for (auto& process : processes_) {
    auto& time = process.cursor;
    time = process.from;
    const auto main = main_of(process);
    add(time++, main,
        RunBegin{.contract_version = kContractVersion,
                 .tool_version = "text",
                 .executor = keep(process.executor),
                 .boot_id = "boot",
                 .host = "robot",
                 .pid = static_cast<std::uint32_t>(process.pid),
                 .pid_ns = 1,
                 .process_start_ns = process.from - 1,
                 .monotonic_ns = time,
                 .realtime_ns = 1'000'000'000 + time,
                 .online_cpus = 2,
                 .spec_sha256 = "",
                 .moment = process.is_attached ? RunMoment::announce : RunMoment::start});
    add(time++, main, ClockSync{.monotonic_ns = time, .realtime_ns = 1'000'000'000 + time});
    add(time++, main, NodeInit{.node = NodeId{0}, .name = "/node"});
    for (const auto& [name, group] : groups_) {
      if (group.process != &process) continue;
      add(time++, main,
          GroupInit{
              .group = GroupId{group.id},
              .node = NodeId{0},
              .type = group.is_reentrant ? GroupType::reentrant : GroupType::mutually_exclusive});
    }
    for (const auto& name : publisher_order_) {
      auto& publisher = publishers_[name];
      if (publisher.process == &process) add(time++, main, publisher.init);
    }
    for (const auto& name : callback_order_) {
      auto& callback = callbacks_[name];
      if (callback.process == &process) add(time++, main, callback.init);
    }
    for (const auto& name : thread_order_) {
      auto& thread = threads_[name];
      if (thread.process != &process || thread.is_silent) continue;
      if (thread.read_backs == 0) thread.read_backs = process.is_attached ? 4 : 0;
    }
  }
}

void Writer::epilogue() {
  auto time = last_ + 10;
  for (auto& process : processes_) {
    if (process.has_crashed) continue;
    auto at = process.until.value_or(time);
    const auto main = main_of(process);
    for (const auto& name : thread_order_) {
      auto& thread = threads_[name];
      if (thread.process != &process || thread.is_silent || thread.has_finish) continue;
      if (thread.is_audited) read_back(at++, cut("0 x x"), thread, SchedMoment::audit);
      thread_fini(at++, thread);
    }
    for (const auto& name : callback_order_) {
      auto& callback = callbacks_[name];
      if (callback.process == &process && !callback.has_fini) add(at++, main, callback.totals);
    }
    for (const auto& name : publisher_order_) {
      auto& publisher = publishers_[name];
      if (publisher.process != &process) continue;
      add(at++, main,
          PublisherFini{.publisher = PublisherId{publisher.id}, .published = publisher.next});
    }
    add(at++, main,
        RunEnd{.callbacks = process.callbacks,
               .threads = process.threads,
               .groups = process.groups,
               .publishers = process.publishers,
               .status = 0});
  }
}

void Writer::frame() {
  std::int64_t begin = kPrologue;
  for (const auto& event : trace_.events)
    begin = std::min(begin, event.head.time.ns);
  std::stable_sort(trace_.events.begin(), trace_.events.end(),
                   [](const Event& a, const Event& b) { return a.head.time < b.head.time; });
  std::vector<Event> framed;
  const auto edge = [&framed](std::int64_t time, StreamIndex stream, EventBody body) {
    framed.push_back(Event{
        .head =
            {.time = {time}, .stream = stream, .cpu = 0, .pid = std::nullopt, .tid = std::nullopt},
        .body = body});
  };
  std::vector<StreamIndex> streams{kUser};
  if (has_kernel_) streams.push_back(kKernel);
  for (const auto stream : streams) {
    edge(begin - 1, stream,
         StreamBegin{.channel = static_cast<std::uint32_t>(stream),
                     .domain = stream == kKernel ? Domain::kernel : Domain::user,
                     .host = "robot",
                     .clock_uuid = "boot",
                     .clock_offset_ns = 1'000'000'000,
                     .path = stream == kKernel ? "kernel" : "ust"});
    edge(begin - 1, stream, PacketBegin{});
  }
  framed.insert(framed.end(), trace_.events.begin(), trace_.events.end());
  for (const auto stream : streams) {
    edge(last_ + 1, stream, PacketEnd{});
    edge(last_ + 1, stream, StreamEnd{});
  }
  trace_.events = std::move(framed);
}

TextTrace Writer::write(std::string_view text) {
  trace_.strings = std::make_shared<std::deque<std::string>>();
  trace_.cpus = std::make_shared<std::deque<std::vector<std::uint32_t>>>();
  std::vector<std::pair<std::int64_t, Line>> lines;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    auto content = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    content = content.substr(0, content.find('#'));
    const auto line = cut(content);
    if (line.words.empty() || declare(line)) continue;
    lines.emplace_back(line.parse(line.word(0)), line);
  }
  process();
  std::stable_sort(lines.begin(), lines.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  prologue();
  // Threads whose read-backs or beginning no line tells begin configured.
  for (const auto& name : thread_order_) {
    auto& thread = threads_[name];
    if (thread.is_silent) continue;
    const auto tells = [&lines, &name](std::string_view verb) {
      return std::any_of(lines.begin(), lines.end(), [&](const auto& entry) {
        const auto& words = entry.second.words;
        return words.size() > 2 && words[1] == verb && words[2] == name;
      });
    };
    auto& time = thread.process->cursor;
    if (!tells("begin")) thread_init(time++, thread);
    if (tells("begin") || tells("initial") || tells("applied")) continue;
    const auto defaults = cut("0 x x");
    thread.is_audited = thread.role == ThreadRole::callback;
    if (thread.process->is_attached) {
      read_back(time++, defaults, thread, SchedMoment::audit);
    } else {
      read_back(time++, defaults, thread, SchedMoment::initial);
      if (thread.role == ThreadRole::callback) {
        read_back(time++, defaults, thread, SchedMoment::applied);
      }
    }
  }
  for (const auto& [time, line] : lines) {
    if (!state_event(time, line) && !kernel_event(time, line) && !recording_event(time, line)) {
      user_event(time, line);
    }
  }
  epilogue();
  frame();
  return std::move(trace_);
}

}  // namespace

TextTrace trace_of(std::string_view text) { return Writer().write(text); }

AnalysisResult analyze(const TextTrace& trace, const AnalysisOptions& options, Observer* observer) {
  Analyzer analyzer(options, observer);
  for (const auto& event : trace.events)
    analyzer.consume(event);
  return analyzer.finish();
}

}  // namespace cie::test
