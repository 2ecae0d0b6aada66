#include "metrics.hpp"

#include <cie/tracepoints/utf8.hpp>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace cie::live {
namespace {

constexpr double kNanoseconds = 1e-9;

using Label = std::pair<std::string_view, std::string_view>;

// {name="value",…}, or nothing.
std::string labels_of(std::initializer_list<Label> labels) {
  std::string text;
  for (const auto& [name, value] : labels) {
    text += text.empty() ? '{' : ',';
    text += name;
    text += "=\"";
    for (const char c : valid_utf8(value)) {
      if (c == '\\' || c == '"') text += '\\';
      text += c == '\n' ? std::string("\\n") : std::string(1, c);
    }
    text += '"';
  }
  return text.empty() ? text : text + '}';
}

void describe(std::string& out, std::string_view name, std::string_view type,
              std::string_view help) {
  out += fmt::format("# HELP {} {}\n# TYPE {} {}\n", name, help, name, type);
}

template <typename Value>
void sample(std::string& out, std::string_view name, const std::string& labels, Value value) {
  out += fmt::format("{}{} {}\n", name, labels, value);
}

std::string labels_of(const CallbackView& c, std::string_view bound = {}) {
  const auto pid = std::to_string(c.pid);
  if (bound.empty()) return labels_of({{"host", c.host}, {"pid", pid}, {"callback", c.logical_id}});
  return labels_of({{"host", c.host}, {"pid", pid}, {"callback", c.logical_id}, {"le", bound}});
}

void add_counts(CallbackView& sum, const CallbackView& c) {
  for (std::size_t i = 0; i < sum.counts.size(); ++i)
    sum.counts[i] += c.counts[i];
  sum.response_sum_ns = analysis::detail::wrapping_add(sum.response_sum_ns, c.response_sum_ns);
  if (c.total_late) sum.total_late = sum.total_late.value_or(0) + *c.total_late;
  if (c.total_missed) sum.total_missed = sum.total_missed.value_or(0) + *c.total_missed;
}

// Callbacks that share all labels (registered again under the same name) are one series.
// `gone`: what those of a series counted that are not in the snapshot any more.
std::vector<CallbackView> merged(const Snapshot& snapshot,
                                 const std::map<std::string, CallbackView>& gone) {
  std::map<std::string, CallbackView> by_labels;
  for (const auto& c : snapshot.callbacks) {
    const auto [found, is_new] = by_labels.try_emplace(labels_of(c), c);
    if (is_new) continue;
    add_counts(found->second, c);
    found->second.deadline_ns = c.deadline_ns;
    found->second.open_ns = std::max(found->second.open_ns, c.open_ns);
  }
  for (const auto& [labels, former] : gone) {
    if (const auto found = by_labels.find(labels); found != by_labels.end())
      add_counts(found->second, former);
  }
  std::vector<CallbackView> result;
  result.reserve(by_labels.size());
  for (auto& [labels, callback] : by_labels)
    result.push_back(std::move(callback));
  return result;
}

void write_histogram(std::string& out, const CallbackView& c) {
  constexpr std::string_view kName = "cie_callback_response_time_seconds";
  const auto bucket = std::string(kName) + "_bucket";
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < kResponseBounds.size(); ++i) {
    count += c.counts[i];
    const auto bound = fmt::format("{}", static_cast<double>(kResponseBounds[i]) * kNanoseconds);
    sample(out, bucket, labels_of(c, bound), count);
  }
  count += c.counts.back();
  sample(out, bucket, labels_of(c, "+Inf"), count);
  sample(out, std::string(kName) + "_sum", labels_of(c),
         static_cast<double>(c.response_sum_ns) * kNanoseconds);
  sample(out, std::string(kName) + "_count", labels_of(c), count);
}

void write_callbacks(std::string& out, const std::vector<CallbackView>& callbacks) {
  describe(out, "cie_callback_response_time_seconds", "histogram",
           "End minus release of each instance of a callback; since its start where the release is "
           "not known.");
  for (const auto& c : callbacks)
    write_histogram(out, c);
  describe(out, "cie_callback_deadline_seconds", "gauge", "Response deadline of a callback.");
  for (const auto& c : callbacks) {
    if (!c.deadline_ns) continue;
    sample(out, "cie_callback_deadline_seconds", labels_of(c),
           static_cast<double>(*c.deadline_ns) * kNanoseconds);
  }
  describe(out, "cie_callback_late_total", "counter", "Instances beyond their response deadline.");
  for (const auto& c : callbacks) {
    if (c.total_late) sample(out, "cie_callback_late_total", labels_of(c), *c.total_late);
  }
  describe(
      out, "cie_callback_open_seconds", "gauge",
      "Since the start of the instance that has been running for longest, as events of its process "
      "show; 0: none runs.");
  for (const auto& c : callbacks) {
    sample(out, "cie_callback_open_seconds", labels_of(c),
           static_cast<double>(c.open_ns.value_or(0)) * kNanoseconds);
  }
  describe(out, "cie_callback_missed_releases_total", "counter", "Periods that a timer skipped.");
  for (const auto& c : callbacks) {
    if (c.total_missed)
      sample(out, "cie_callback_missed_releases_total", labels_of(c), *c.total_missed);
  }
}

void write_threads(std::string& out, const std::vector<ThreadView>& threads) {
  describe(out, "cie_thread_cpu_ratio", "gauge",
           "CPU time of a thread per time, since the snapshot before; 1 is one CPU.");
  for (const auto& t : threads) {
    if (!t.cpu_percent) continue;
    const auto pid = std::to_string(t.pid);
    const auto tid = std::to_string(t.tid);
    sample(out, "cie_thread_cpu_ratio",
           labels_of({{"host", t.host}, {"pid", pid}, {"tid", tid}, {"thread", t.name}}),
           *t.cpu_percent / 100);
  }
}

std::uint64_t defect(const Snapshot& snapshot, std::string_view kind) {
  const auto found = std::ranges::find(snapshot.defects, kind, &DefectView::kind);
  return found == snapshot.defects.end() ? 0 : found->count;
}

void write_source(std::string& out, const Snapshot& s) {
  const bool is_up = s.state != SourceState::lost && s.state != SourceState::ended;
  describe(out, "cie_live_up", "gauge", "Whether the session is being followed.");
  sample(out, "cie_live_up", {}, is_up && s.sequence > 0 ? 1 : 0);
  if (!s.hosts.empty()) {
    describe(out, "cie_live_host_up", "gauge", "Whether events of the machine's session come.");
  }
  for (const auto& host : s.hosts) {
    const bool is_streaming =
        host.state == SourceState::streaming || host.state == SourceState::waiting;
    sample(out, "cie_live_host_up", labels_of({{"host", host.host}, {"session", host.session}}),
           is_streaming ? 1 : 0);
  }
  describe(out, "cie_live_snapshots_total", "counter", "Snapshots that were taken.");
  sample(out, "cie_live_snapshots_total", {}, s.sequence);
  describe(out, "cie_live_events_total", "counter", "Events that were read.");
  sample(out, "cie_live_events_total", {}, s.events);
  describe(out, "cie_live_lost_events_total", "counter",
           "Events that the tracer counted as discarded.");
  sample(out, "cie_live_lost_events_total", {}, defect(s, "discarded-events"));
  describe(out, "cie_live_lost_packets_total", "counter",
           "Packets that did not arrive, with an unknown number of events.");
  sample(out, "cie_live_lost_packets_total", {}, s.lost_packets);
  if (s.delay_ns) {
    describe(out, "cie_live_delay_seconds", "gauge", "How old the latest instance is.");
    sample(out, "cie_live_delay_seconds", {}, static_cast<double>(*s.delay_ns) * kNanoseconds);
  }
}

}  // namespace

void Metrics::add(const Snapshot& snapshot) {
  for (auto& [rule, violations] : violations_)
    violations.current = 0;
  for (const auto& rule : snapshot.violations) {
    auto& violations = violations_[rule.rule];
    violations.name = rule.name;
    violations.current = rule.subjects;
  }
  for (const auto& change : snapshot.changes) {
    auto& violations = violations_[change.rule];
    violations.name = change.name;
    violations.total += change.to == analysis::Verdict::fail ? 1 : 0;
  }
  keep_counts_of_what_is_gone(snapshot);
  latest_ = snapshot;
}

// A callback whose process ended is shown for a while; one of the next process of that pid, as in a
// container that starts again, goes on counting where it stopped.
void Metrics::keep_counts_of_what_is_gone(const Snapshot& next) {
  std::set<std::uint32_t> indices;
  std::set<std::string> series;
  for (const auto& callback : next.callbacks) {
    indices.insert(callback.index);
    series.insert(labels_of(callback));
  }
  for (const auto& callback : latest_.callbacks) {
    if (indices.contains(callback.index)) continue;
    const auto [found, is_new] = gone_.try_emplace(labels_of(callback), callback);
    if (!is_new) add_counts(found->second, callback);
  }
  std::erase_if(gone_, [&series](const auto& entry) { return !series.contains(entry.first); });
}

std::string Metrics::text() const {
  std::string out;
  write_source(out, latest_);
  write_callbacks(out, merged(latest_, gone_));
  write_threads(out, latest_.threads);
  describe(out, "cie_rule_violations", "gauge", "Subjects that violate a rule of cie verify now.");
  for (const auto& [rule, violations] : violations_) {
    sample(out, "cie_rule_violations", labels_of({{"rule", rule}, {"name", violations.name}}),
           violations.current);
  }
  describe(out, "cie_rule_violations_begun_total", "counter",
           "Times that a subject began to violate a rule.");
  for (const auto& [rule, violations] : violations_) {
    sample(out, "cie_rule_violations_begun_total",
           labels_of({{"rule", rule}, {"name", violations.name}}), violations.total);
  }
  return out;
}

}  // namespace cie::live
