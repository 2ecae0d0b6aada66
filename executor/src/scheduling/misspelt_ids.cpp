#include "misspelt_ids.hpp"

#include <cie/tracepoints/logical_id.hpp>
#include <cie/tracepoints/nearest_name.hpp>

#include <algorithm>
#include <iterator>
#include <set>
#include <string_view>

namespace cie::scheduling {
namespace {

constexpr std::size_t kMost = 256;  // a spec may be another system's

using Names = std::vector<std::string>;
using NameSet = std::set<std::string_view>;

template <typename Predicate>
Names those(const Names& names, Predicate is_wanted) {
  Names found;
  std::ranges::copy_if(names, std::back_inserter(found), is_wanted);
  return found;
}

class Search {
 public:
  Search(const SchedulingSpec& spec, const KnownIds& known)
      : spec_(spec),
        nodes_(known.nodes.begin(), known.nodes.end()),
        threads_(known.threads.begin(), known.threads.end()) {
    NameSet named;  // wherever in the spec
    for (const SpecEntry& entry : spec.callbacks())
      named.insert(entry.id);
    for (const SpecChain& chain : spec.chains())
      named.insert(chain.callbacks.begin(), chain.callbacks.end());
    NameSet unconfigured;
    for (const SpecCallback& callback : known.callbacks) {
      ids_.push_back(callback.id);
      callbacks_.insert(callback.id);
      const auto* const entry = spec.find_callback(callback.id, callback.period_ns);
      if (entry == nullptr) unconfigured.insert(LogicalId::node_of(callback.id));
      if (entry != nullptr && !entry->is_wildcard()) {  // perhaps by its period
        callbacks_.insert(entry->id);
        named.insert(callback.id);
      }
    }
    unnamed_callbacks_ = those(ids_, [&named](const auto& id) { return !named.contains(id); });
    unnamed_nodes_ =
        those(known.nodes, [&](const auto& name) { return unconfigured.contains(name); });
    unnamed_threads_ = those(
        known.threads, [&spec](const auto& name) { return spec.find_thread(name) == nullptr; });
  }

  std::vector<SchedulingProblem> run() {
    NameSet told;
    for (const SpecEntry& entry : spec_.callbacks()) {
      told.insert(entry.id);
      if (entry.is_wildcard()) {
        check_wildcard(entry);
      } else {
        check_callback(entry.id, entry.line, "it configures nothing");
      }
    }
    for (const SpecChain& chain : spec_.chains()) {
      for (const std::string& id : chain.callbacks) {
        if (!told.insert(id).second) continue;
        check_callback(id, chain.line, "chain \"" + chain.name + "\" is never seen");
      }
    }
    for (const SpecEntry& entry : spec_.threads()) {
      if (entry.is_dds_thread || threads_.contains(entry.id)) continue;
      const auto meant = did_you_mean(entry.id, unnamed_threads_);
      if (!meant.empty())
        add(entry.id, entry.line, "no thread is called so: it configures nothing" + meant);
    }
    return std::move(problems_);
  }

 private:
  void check_wildcard(const SpecEntry& entry) {
    const auto node = entry.node();
    if (nodes_.contains(node)) return;
    const auto meant = nearest_name(node, unnamed_nodes_);
    if (meant.empty()) return;
    add(entry.id, entry.line,
        "no node is called so: it configures nothing; did you mean \"" + std::string{meant} +
            "/*\"?");
  }

  void check_callback(std::string_view id, int line, const std::string& effect) {
    if (callbacks_.contains(id) || problems_.size() == kMost) return;
    const auto node = LogicalId::node_of(id);
    const bool is_node_here = nodes_.contains(node);
    auto meant = did_you_mean(id, unnamed_callbacks_);
    if (meant.empty() && is_node_here) {
      meant = did_you_mean(
          id, those(ids_, [node](const auto& each) { return LogicalId::node_of(each) == node; }));
    }
    if (meant.empty() && !is_node_here) return;
    add(id, line, "no callback has this id: " + effect + meant);
  }

  void add(std::string_view id, int line, std::string reason) {
    problems_.push_back({.file = spec_.name(),
                         .line = line,
                         .entry = std::string{id},
                         .reason = std::move(reason),
                         .is_misspelt = true});
  }

  const SchedulingSpec& spec_;
  NameSet nodes_;
  NameSet callbacks_;
  NameSet threads_;
  Names ids_;
  Names unnamed_callbacks_;
  Names unnamed_nodes_;
  Names unnamed_threads_;
  std::vector<SchedulingProblem> problems_;
};

}  // namespace

std::vector<SchedulingProblem> misspelt_ids(const SchedulingSpec& spec, const KnownIds& known) {
  return Search{spec, known}.run();
}

}  // namespace cie::scheduling
