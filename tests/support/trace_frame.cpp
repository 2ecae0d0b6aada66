#include "support/trace_writer.hpp"

#include <algorithm>
#include <utility>

namespace cie::test::text {
namespace {

constexpr std::uint32_t kCpus = 2;

StreamIndex kernel_stream(std::int32_t cpu) {
  return StreamIndex{static_cast<std::uint32_t>(kKernel) + static_cast<std::uint32_t>(cpu)};
}

}  // namespace

RunBegin Writer::run_begin(const Process& process, std::int64_t time, const std::string& spec,
                           RunMoment moment) {
  return {.contract_version = kContractVersion,
          .tool_version = "text",
          .executor = keep(process.executor),
          .boot_id = "boot",
          .host = "robot",
          .pid = static_cast<std::uint32_t>(process.pid),
          .pid_ns = 1,
          .process_start_ns = process.from - 1,
          .monotonic_ns = time,
          .realtime_ns = 1'000'000'000 + time,
          .online_cpus = kCpus,
          .spec_sha256 = keep(spec),
          .moment = moment,
          .monotonic_offset_ns = process.ahead};
}

void Writer::prologue() {
  for (auto& process : processes_) {
    auto& time = process.cursor;
    time = process.from;
    const auto main = main_of(process);
    add(time, main,
        run_begin(process, time, process.spec,
                  process.is_attached ? RunMoment::announce : RunMoment::start));
    ++time;
    add(time, main, ClockSync{.monotonic_ns = time, .realtime_ns = 1'000'000'000 + time});
    ++time;
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

// A thread whose beginning or read-backs no line tells begins configured.
void Writer::configure(Thread& thread, const std::vector<TimedLine>& lines) {
  if (thread.is_silent) return;
  const auto tells = [&lines, &thread](std::string_view verb) {
    return std::any_of(lines.begin(), lines.end(), [&](const auto& entry) {
      const auto& words = entry.second.words;
      return words.size() > 2 && words[1] == verb && words[2] == thread.name;
    });
  };
  auto& time = thread.process->cursor;
  if (!tells("begin")) {
    thread.start = time;
    thread_init(time++, thread);
  }
  if (tells("begin") || tells("initial") || tells("applied")) return;
  const auto defaults = cut("0 x x");
  thread.is_audited = thread.role == ThreadRole::callback;
  if (thread.process->is_attached) {
    read_back(time++, defaults, thread, SchedMoment::audit);
    return;
  }
  read_back(time++, defaults, thread, SchedMoment::initial);
  if (thread.role == ThreadRole::callback)
    read_back(time++, defaults, thread, SchedMoment::applied);
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
    add(at, main, ClockSync{.monotonic_ns = at, .realtime_ns = 1'000'000'000 + at});
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
  // One stream of the user's, and of the kernel's one for each CPU.
  std::vector<std::pair<StreamIndex, std::int32_t>> streams{{kUser, 0}};
  std::int32_t cpus = has_kernel_ ? static_cast<std::int32_t>(kCpus) : 0;
  for (auto& event : trace_.events) {
    const auto cpu = event.head.cpu.value_or(0);
    if (has_kernel_) cpus = std::max(cpus, cpu + 1);
    if (event.head.stream == kKernel) event.head.stream = kernel_stream(cpu);
  }
  for (std::int32_t cpu = 0; cpu < cpus; ++cpu)
    streams.emplace_back(kernel_stream(cpu), cpu);
  std::vector<Event> framed;
  const auto edge = [&framed](std::int64_t time, const auto& stream, EventBody body) {
    framed.push_back(Event{.head = {.time = {time},
                                    .stream = stream.first,
                                    .cpu = stream.second,
                                    .pid = std::nullopt,
                                    .tid = std::nullopt},
                           .body = body});
  };
  for (const auto& stream : streams) {
    const bool is_kernel = stream.first != kUser;
    edge(begin - 1, stream,
         StreamBegin{.channel = static_cast<std::uint32_t>(is_kernel ? kKernel : kUser),
                     .domain = is_kernel ? Domain::kernel : Domain::user,
                     .host = "robot",
                     .clock_uuid = "boot",
                     .clock_offset_ns = 1'000'000'000,
                     .path = is_kernel ? "kernel" : "ust"});
    edge(begin - 1, stream, PacketBegin{});
  }
  framed.insert(framed.end(), trace_.events.begin(), trace_.events.end());
  for (const auto& stream : streams) {
    edge(last_ + 1, stream, PacketEnd{});
    edge(last_ + 1, stream, StreamEnd{});
  }
  trace_.events = std::move(framed);
}

}  // namespace cie::test::text
