#include "doubtful_ids.hpp"

#include <cie/tracepoints/logical_id.hpp>

#include "logical_ids.hpp"
#include "loss_gaps.hpp"
#include "recorded_parts.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

bool is_named(const CallbackFacts& callback) {
  return callback.registered && callback.is_identified;
}

// Ids that are known in part ("/node@Timer(?)", "?@Timer(10)"). When their callbacks were made is not known: those
// that run are told of when they do.
class PartlyKnown {
 public:
  void add(const CallbackFacts& callback) {
    if (callback.registered) ids_.emplace(LogicalId::without_number(callback.logical_id));
  }
  // One of them may be this one: numbers of it are one too low if that callback was made before.
  bool may_hold(const IdParts& parts) const {
    if (ids_.empty()) return false;
    const auto kind = parts.kind_and_what.substr(0, parts.kind_and_what.find('('));
    for (const auto node : {parts.node, std::string_view("?")}) {
      for (const auto& rest : {std::string(parts.kind_and_what), std::string(kind) + "(?)"})
        if (ids_.contains(std::string(node) + rest)) return true;
    }
    return false;
  }

 private:
  std::set<std::string> ids_;
};

struct Callbacks {
  std::map<std::string_view, std::vector<CallbackFacts*>> by_id;  // without numbers
  std::set<std::string_view> without_node;                        // IdParts::kind_and_what of those
  std::vector<const CallbackFacts*> nameless;
  PartlyKnown partly_known;
};

// Another process with this pid may have made the one of its id before it.
bool follows_rcl_init(const CallbackFacts& callback) {
  const bool is_numbered =
      LogicalId::without_number(callback.logical_id).size() < callback.logical_id.size();
  return callback.is_after_rcl_init && is_numbered;
}

// What is known of the nameless one may be said of the other.
bool may_be_alike(const CallbackFacts& nameless, const CallbackFacts& other) {
  const bool is_kind_alike = !nameless.kind || nameless.kind == other.kind;
  return is_kind_alike && (nameless.node.empty() || nameless.node == other.node);
}

// When it was there for certain. Its registration may be told at any time after it was made.
Timestamp last_seen(const CallbackFacts& callback) {
  auto last = callback.made;
  if (callback.starts.last) last = std::max(last, callback.starts.last_at.time);
  if (callback.ended.last) last = std::max(last, callback.ended.last_at.time);
  return callback.own ? std::min(last, callback.own->others_since.time) : last;
}

void find_least_numbers(const std::vector<CallbackFacts*>& of_id) {
  if (of_id.size() < 2) return;
  auto made = of_id;
  std::ranges::stable_sort(made, {}, &CallbackFacts::made);
  auto seen = of_id;
  std::ranges::stable_sort(seen, {}, [](const auto* each) { return last_seen(*each); });
  auto next = seen.begin();
  std::uint32_t least = 0;
  for (auto* callback : made) {
    for (; next != seen.end() && last_seen(**next) <= callback->made; ++next) {
      const auto number = id_number((*next)->logical_id);
      least = least == 0 ? number : std::min(least, number);
    }
    if (least < id_number(callback->logical_id)) callback->least_number = least;
  }
}

}  // namespace

void doubt_numbered_ids(Model& model) {
  std::map<ProcessIndex, Callbacks> processes;
  for (auto& callback : model.callbacks) {
    callback.may_be_another = false;
    callback.least_number = 0;
    if (callback.is_accounted) continue;
    auto& callbacks = processes[callback.process];
    if (is_named(callback)) {
      callbacks.by_id[LogicalId::without_number(callback.logical_id)].push_back(&callback);
      const IdParts parts(callback.logical_id);
      if (parts.lacks_node()) callbacks.without_node.insert(parts.kind_and_what);
    } else {
      callbacks.nameless.push_back(&callback);
      callbacks.partly_known.add(callback);
    }
  }
  if (processes.empty()) return;
  const bool is_part_missing =
      missing_user_part(model).has_value() || !recorder_failures(model).empty();
  for (auto& [index, callbacks] : processes) {
    const auto& process = model.processes[at(index)];
    const auto begin = process.ros2_begin ? process.ros2_begin->time : TimeWindow{}.from;
    const auto may_lack_earlier = [&](const CallbackFacts& callback) {
      return is_part_missing ||
             user_gap(model, process.host, begin, callback.registered->time) != nullptr;
    };
    for (auto& [id, of_id] : callbacks.by_id) {
      find_least_numbers(of_id);
      const IdParts parts(id);
      const bool is_one_without_node =
          !parts.lacks_node() && callbacks.without_node.contains(parts.kind_and_what);
      const bool may_be_known_in_part = callbacks.partly_known.may_hold(parts);
      for (auto* callback : of_id) {
        const auto has_namesake = [callback](const CallbackFacts* nameless) {
          return may_be_alike(*nameless, *callback);
        };
        const bool is_beside_nameless = std::ranges::any_of(callbacks.nameless, has_namesake);
        const bool is_beside_another =
            is_beside_nameless || of_id.size() > 1 || is_one_without_node;
        const bool may_be_lost = may_lack_earlier(*callback) && is_beside_another;
        callback->is_beside_partly_known = may_be_known_in_part && !may_be_lost;
        callback->may_be_another = follows_rcl_init(*callback) || may_be_known_in_part ||
                                   may_be_lost || (!process.ros2_begin && is_beside_nameless);
      }
    }
  }
}

}  // namespace cie::analysis
