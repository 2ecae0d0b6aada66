#include "support/trace_writer.hpp"

namespace cie::test::text {

void Writer::read_back(std::int64_t time, const Line& line, Thread& thread, SchedMoment moment) {
  static const std::map<std::string, std::int32_t, std::less<>> policies{
      {"other", 0}, {"fifo", 1}, {"rr", 2}, {"batch", 3}, {"idle", 5}, {"deadline", 6}, {"ext", 7}};
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
                    .error = line.number<std::int32_t>("error", 0),
                    .slice_ns = line.number<std::uint64_t>("slice", 0),
                    .util_min = line.number<std::uint32_t>("util_min", 0),
                    .util_max = line.number<std::uint32_t>("util_max", 1024),
                    .change = line.number<std::uint32_t>("change", 0)};
  if (line.has("old")) event.slice_ns = std::nullopt;
  if (line.has("old")) event.util_min = event.util_max = std::nullopt;
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
    if (line.has("again")) {
      thread.read_backs = 0;
    } else {
      thread.start = time;
    }
    if (line.gives("for")) {
      const auto& owner = named(callbacks_, line, line.value("for", ""));
      thread.callback = owner.id;
      thread.group = owner.group->id;
    }
    thread_init(time, thread);
  } else if (verb == "repeat") {
    const auto& thread = named(threads_, line, line.word(2));
    add(time, of_line(line, &thread, *thread.process), init_of(thread));
  } else if (verb == "finish") {
    auto& thread = named(threads_, line, line.word(2));
    thread.has_finish = true;
    thread_fini(time, thread);
  } else if (verb == "init") {
    auto& callback = named(callbacks_, line, line.word(2));
    callback.has_init = true;
    auto init = callback.init;
    init.next_seq = callback.next;
    add(time, of_line(line, nullptr, *callback.process), init);
  } else if (verb == "reload") {
    add(time, main_of(process()),
        run_begin(process(), time, line.value("spec", ""), RunMoment::announce));
  } else if (verb == "fini") {
    auto& callback = named(callbacks_, line, line.word(2));
    callback.has_fini = true;
    add(time, main_of(*callback.process), callback.totals);
  } else {
    return false;
  }
  return true;
}

ThreadInit Writer::init_of(const Thread& thread) {
  return {.tid = static_cast<std::uint32_t>(thread.tid),
          .role = thread.role,
          .callback = CallbackId{thread.callback},
          .group = GroupId{thread.group},
          .name = keep(thread.name),
          .start_ns = thread.start};
}

void Writer::thread_init(std::int64_t time, Thread& thread) {
  add(time, by(thread), init_of(thread));
  ++thread.process->threads;
}

void Writer::thread_fini(std::int64_t time, Thread& thread) {
  add(time, by(thread),
      ThreadFini{.tid = static_cast<std::uint32_t>(thread.tid), .read_backs = thread.read_backs});
}

}  // namespace cie::test::text
