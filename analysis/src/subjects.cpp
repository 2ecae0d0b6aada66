#include "subjects.hpp"

#include <algorithm>
#include <tuple>

namespace cie::analysis {

Subjects::Subjects(const Model& model) : model_(model) {
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

std::string Subjects::suffix(ProcessIndex index) const {
  if (!has_several_) return {};
  const auto& process = model_.processes[at(index)];
  const auto host = has_several_hosts_ ? " on " + model_.hosts[at(process.host)].name : "";
  return " (pid " + std::to_string(process.pid) + host + ")";
}

std::string Subjects::process(ProcessIndex index) const {
  return "process " + std::to_string(model_.processes[at(index)].pid) + suffix(index);
}

std::string Subjects::callback(CallbackIndex index) const {
  const auto& callback = model_.callbacks[at(index)];
  return callback_named(callback.logical_id) + suffix(callback.process);
}

std::string Subjects::callback_named(const std::string& logical_id) {
  return "callback " + logical_id;
}

std::string Subjects::thread(ThreadIndex index) const {
  const auto& thread = model_.threads[at(index)];
  return "thread " + std::to_string(thread.tid) + suffix(thread.process);
}

std::string Subjects::group(const GroupFacts& group) const {
  return "group " + std::to_string(to_number(group.id)) + suffix(group.process);
}

std::string Subjects::topic(const PublisherFacts& publisher) const {
  const auto name =
      publisher.registered ? publisher.topic : "?" + std::to_string(to_number(publisher.id));
  return "topic " + name + suffix(publisher.process);
}

std::string Subjects::chain(const ChainFacts& chain) const {
  return "chain " + chain.name + (chain.process ? suffix(*chain.process) : "");
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
  std::sort(order.begin(), order.end(),
            [&key](CallbackIndex a, CallbackIndex b) { return key(a) < key(b); });
  return order;
}

}  // namespace cie::analysis
