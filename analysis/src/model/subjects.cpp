#include "subjects.hpp"

#include <cie/analysis/report_rows.hpp>

#include "sort_rows.hpp"

#include <map>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace cie::analysis {
namespace {

// By process, as Subjects::program_of() has it.
std::vector<std::uint32_t> programs_of_pids(const Model& model) {
  std::map<std::pair<HostIndex, std::int64_t>, std::vector<std::size_t>> of_pid;
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto& process = model.processes[i];
    if (process.has_cie_events) of_pid[{process.host, process.pid}].push_back(i);
  }
  std::vector<std::uint32_t> programs(model.processes.size());
  for (const auto& [pid, processes] : of_pid) {
    for (std::size_t i = 0; processes.size() > 1 && i < processes.size(); ++i)
      programs[processes[i]] = static_cast<std::uint32_t>(i + 1);
  }
  return programs;
}

// Of each callback of a process how many up to it have its logical id. In order, a process's callbacks
// stand together.
std::vector<std::uint32_t> lifetimes_of_callbacks(const Model& model,
                                                  std::span<const CallbackIndex> in_order) {
  std::unordered_map<std::string_view, std::uint32_t> counts;
  counts.reserve(in_order.size());
  std::optional<ProcessIndex> process;
  std::vector<std::uint32_t> lifetimes(model.callbacks.size());
  for (const auto index : in_order) {
    const auto& callback = model.callbacks[at(index)];
    if (process != callback.process) counts.clear();
    process = callback.process;
    lifetimes[at(index)] = ++counts[callback.logical_id];
  }
  return lifetimes;
}

// Of each item how many up to it, itself included, have its key.
template <typename Items, typename KeyOf>
std::vector<std::uint32_t> numbered_by(const Items& items, const KeyOf& key_of) {
  std::map<decltype(key_of(items.front())), std::uint32_t> counts;
  std::vector<std::uint32_t> numbers;
  numbers.reserve(items.size());
  for (const auto& item : items)
    numbers.push_back(++counts[key_of(item)]);
  return numbers;
}

std::string topic_name(const PublisherFacts& publisher) {
  return publisher.registered ? publisher.topic : "?" + std::to_string(to_number(publisher.id));
}

}  // namespace

Subjects::Subjects(const Model& model, std::span<const CallbackIndex> callbacks)
    : model_(model),
      programs_(programs_of_pids(model)),
      callbacks_(lifetimes_of_callbacks(model, callbacks)) {
  const ProcessFacts* first = nullptr;
  for (const auto& process : model.processes) {
    if (!process.has_cie_events) continue;
    if (first == nullptr) {
      first = &process;
      continue;
    }
    has_several_ = true;
    has_several_hosts_ = has_several_hosts_ || process.host != first->host;
  }
}

std::string_view label(SubjectKind kind) noexcept {
  switch (kind) {
    case SubjectKind::trace:
      return "trace";
    case SubjectKind::process:
      return "process";
    case SubjectKind::thread:
      return "thread";
    case SubjectKind::callback:
      return "callback";
    case SubjectKind::group:
      return "group";
    case SubjectKind::topic:
      return "topic";
    case SubjectKind::chain:
      return "chain";
  }
  return {};
}

NamedSubject NamedSubject::without_row(SubjectKind kind, const std::string& name) {
  return {.about = {.kind = kind}, .name = std::string(label(kind)) + ' ' + name};
}

NamedSubject Subjects::named(Subject about, const std::string& name, std::string ordinal) const {
  return {.about = about,
          .name = std::string(label(about.kind)) + ' ' + name,
          .ordinal = std::move(ordinal),
          .place = about.process ? place_of(*about.process) : std::string()};
}

std::string Subjects::place_of(ProcessIndex index) const {
  if (!has_several_) return {};
  const auto& process = model_.processes[at(index)];
  const auto host = has_several_hosts_ ? " on " + model_.hosts[at(process.host)].name : "";
  return " (" + pid_words(process.pid, program_of(index)) + host + ")";
}

std::string Subjects::lifetime_of(ThreadIndex index) const {
  if (lifetimes_.empty()) {
    lifetimes_ = numbered_by(model_.threads, [](const ThreadFacts& thread) {
      return std::pair(thread.process, thread.tid);
    });
  }
  return ordinal("lifetime", lifetimes_[at(index)]);
}

std::string Subjects::ordinal_of(PublisherIndex index) const {
  if (publishers_.empty()) {
    publishers_ = numbered_by(model_.publishers, [](const PublisherFacts& publisher) {
      return std::pair(publisher.process, topic_name(publisher));
    });
  }
  return ordinal("publisher", publishers_[at(index)]);
}

NamedSubject Subjects::process(ProcessIndex index) const {
  return named(Subject::of(SubjectKind::process, index, index),
               std::to_string(model_.processes[at(index)].pid));
}

NamedSubject Subjects::callback(CallbackIndex index) const {
  const auto& callback = model_.callbacks[at(index)];
  return named(Subject::of(SubjectKind::callback, index, callback.process), callback.logical_id,
               ordinal("lifetime", callbacks_[at(index)]));
}

NamedSubject Subjects::thread(ThreadIndex index) const {
  const auto& thread = model_.threads[at(index)];
  return named(Subject::of(SubjectKind::thread, index, thread.process), std::to_string(thread.tid),
               lifetime_of(index));
}

NamedSubject Subjects::group(GroupIndex index) const {
  const auto& group = model_.groups[at(index)];
  return named(Subject::of(SubjectKind::group, index, group.process),
               std::to_string(to_number(group.id)));
}

NamedSubject Subjects::group(ProcessIndex process, GroupId id) const {
  return named({.kind = SubjectKind::group, .process = process},
               id == kNoGroup ? "unknown" : std::to_string(to_number(id)));
}

NamedSubject Subjects::group_of(ThreadIndex index) const {
  const auto& thread = model_.threads[at(index)];
  return named({.kind = SubjectKind::group, .process = thread.process},
               "of thread " + std::to_string(thread.tid), lifetime_of(index));
}

NamedSubject Subjects::topic(PublisherIndex index) const {
  const auto& publisher = model_.publishers[at(index)];
  return named(Subject::of(SubjectKind::topic, index, publisher.process), topic_name(publisher),
               ordinal_of(index));
}

NamedSubject Subjects::chain(ChainIndex index) const {
  const auto& chain = model_.chains[at(index)];
  return named(Subject::of(SubjectKind::chain, index, chain.process), chain.name);
}

std::vector<CallbackIndex> callbacks_in_order(const Model& model) {
  std::vector<CallbackIndex> order;
  order.reserve(model.callbacks.size());
  for (std::size_t i = 0; i < model.callbacks.size(); ++i) {
    order.push_back(CallbackIndex{static_cast<std::uint32_t>(i)});
  }
  const auto key = [&model](CallbackIndex index) {
    const auto& callback = model.callbacks[at(index)];
    const auto& process = model.processes[at(callback.process)];
    return std::make_tuple(at(process.host), process.pid, at(callback.process),
                           to_number(callback.id));
  };
  sort_rows(order, {}, key);
  return order;
}

}  // namespace cie::analysis
