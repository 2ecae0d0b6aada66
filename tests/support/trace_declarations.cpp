#include "support/trace_writer.hpp"

namespace cie::test::text {

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
    current_->spec = line.value("spec", "");
    current_->from = line.number("from", kPrologue);
    if (line.gives("until")) current_->until = line.number("until", 0);
    current_->ahead = line.number("ahead", 0);
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

}  // namespace cie::test::text
