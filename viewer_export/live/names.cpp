#include "names.hpp"

#include <cstddef>
#include <utility>

namespace cie::live {
namespace {

// As far as names rest on it.
analysis::Report report_of(const Snapshot& snapshot) {
  analysis::Report report;
  std::map<std::pair<std::string_view, std::int64_t>, analysis::ProcessIndex> processes;
  for (const auto& view : snapshot.callbacks) {
    const auto next = static_cast<analysis::ProcessIndex>(processes.size());
    const auto [process, is_new] = processes.try_emplace({view.host, view.pid}, next);
    if (is_new) {
      auto& row = report.processes.emplace_back();
      row.index = next;
      row.host = view.host;
      row.pid = view.pid;
    }
    auto& row = report.callbacks.emplace_back();
    row.index = analysis::CallbackIndex{view.index};
    row.process = process->second;
    row.logical_id = view.logical_id;
    if (view.period_ns > 0) row.period_ns = view.period_ns;
  }
  return report;
}

}  // namespace

Names::Names(const Snapshot& snapshot, const viewer_export::TextStyle& style)
    : names_(report_of(snapshot), style), has_symbols_(style.unicode) {
  analysis::CallbackReport row;
  for (const auto& view : snapshot.callbacks) {
    row.index = analysis::CallbackIndex{view.index};
    by_index_.emplace(view.index, names_.of(row));
  }
}

std::string Names::in_words(std::string_view sentence) const {
  auto text = names_.in_words(sentence);
  return has_symbols_ ? text : viewer_export::without_symbols(std::move(text));
}

std::string Names::of(const CallbackView& callback) const {
  const auto found = by_index_.find(callback.index);
  return found == by_index_.end() ? names_.of_id(callback.logical_id) : found->second;
}

}  // namespace cie::live
