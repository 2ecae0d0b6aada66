// What a live system looks like at one moment: plain data that every view shows. It comes as one
// line of JSON (snapshot_json.hpp) from the process that reads the system.
#pragma once

#include <cie/analysis/rare.hpp>
#include <cie/analysis/report.hpp>
#include <cie/analysis/statistics.hpp>
#include <cie/analysis/verdict.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cie::live {

enum class SourceState : std::uint8_t {
  waiting,    // connected, no event yet
  streaming,  // events come
  silent,     // none came since the snapshot before
  lost,       // the connection broke; trying again
  ended       // the session is over
};

// Upper bounds of the classes that response times are counted in, in nanoseconds; one more class
// holds those above the last.
inline constexpr std::array<std::int64_t, 19> kResponseBounds{
    10'000,        20'000,        50'000,        100'000,       200'000,
    500'000,       1'000'000,     2'000'000,     5'000'000,     10'000'000,
    20'000'000,    50'000'000,    100'000'000,   200'000'000,   500'000'000,
    1'000'000'000, 2'000'000'000, 5'000'000'000, 10'000'000'000};
using ResponseCounts = std::array<std::uint64_t, kResponseBounds.size() + 1>;

// One run of a callback, as lists of recent ones show it. Times in nanoseconds of CLOCK_MONOTONIC.
struct RecentInstance {
  std::uint64_t seq = 0;
  std::int64_t tid = 0;
  std::optional<std::int32_t> cpu;  // at its start
  std::int64_t start_ns = 0;
  std::int64_t end_ns = 0;
  std::int64_t response_ns = 0;
  bool is_exact = false;  // false: response_ns is a lower bound, the release is not known
  bool is_late = false;   // beyond its deadline
  std::uint32_t missed = 0;
  std::optional<std::int64_t> execution_ns;
};

struct CallbackView {
  std::uint32_t index = 0;  // its number, for as long as the analysis runs
  std::string host;
  std::int64_t pid = 0;
  std::string logical_id;  // "?3" while its registration was not seen
  std::string name{};      // for people: "planner ← /pose"
  std::string kind;
  std::vector<std::int64_t> tids;
  std::optional<analysis::Isolation> isolation;  // empty: unknown
  bool has_ended = false;                        // its process has
  std::optional<std::int64_t> deadline_ns;
  bool is_deadline_of_spec = false;  // and not the one that the callback declared
  std::uint64_t period_ns = 0;       // of a timer; 0: none, or unknown

  // In the window.
  std::uint64_t instances = 0;
  std::optional<std::uint64_t> late;    // empty: without a deadline
  std::optional<std::uint64_t> missed;  // releases; empty: no timer, or unknown
  analysis::Rare<analysis::Summary> response;
  // Since the beginning.
  std::uint64_t total_instances = 0;
  std::optional<std::uint64_t> total_late;
  std::optional<std::uint64_t> total_missed;
  bool is_missing_too_many = false;                  // more than it may (R2)
  analysis::Rare<analysis::Summary> total_response;  // the report's
  bool is_exact = true;     // false: some release was not known, so response times are lower bounds
  ResponseCounts counts{};  // of all instances
  std::int64_t response_sum_ns = 0;  // of all instances

  // Instances that have begun and not ended.
  std::optional<std::int64_t> open_ns;  // the longest: since its start; empty: there is none
  std::uint64_t open_late = 0;          // beyond the deadline for certain; counted as late
  bool is_open_long = false;            // the longest; see Monitor::kOpenLongNs
  bool is_open_certain = false;         // likewise; false: its end may be missing

  std::optional<std::int64_t> last_response_ns;
  std::optional<std::int64_t> last_end_ns;
  std::vector<RecentInstance> recent;  // ended since the snapshot before; the last few, in order
};

struct ThreadView {
  std::uint32_t index = 0;  // its number, for as long as the analysis runs
  std::string host;
  std::int64_t pid = 0;
  std::int64_t tid = 0;
  std::string name;
  std::string role;
  std::vector<std::string> callbacks;
  std::optional<double> cpu_percent;  // of one CPU, since the snapshot before
};

// A verdict that is not a pass.
struct VerdictView {
  std::string rule;  // "M2"
  std::string name;
  analysis::Subject about{};
  std::string subject;
  analysis::Verdict verdict = analysis::Verdict::fail;
  std::int64_t since_ns = 0;
  std::string note;    // its first evidence
  std::string says{};  // which subject, and why, by short names
};

// How many subjects violate a rule.
struct RuleViolations {
  std::string rule;
  std::string name;
  std::uint64_t subjects = 0;
};

// A verdict became another one.
struct VerdictChange {
  std::int64_t time_ns = 0;  // of the trace, when that was noticed
  std::string rule;
  std::string name;
  analysis::Subject about{};
  std::string subject;
  analysis::Verdict from = analysis::Verdict::not_applicable;
  analysis::Verdict to = analysis::Verdict::not_applicable;
  std::string note;
  std::string says{};  // which subject, and why, by short names
};

struct DefectView {
  std::string kind;
  std::string severity;
  std::uint64_t count = 0;
};

// A machine's session at the relay daemon that all are followed at.
struct HostView {
  std::string host;
  std::string session;
  SourceState state = SourceState::waiting;  // silent: nothing came for three seconds
  std::int64_t silent_ns = 0;                // since events of it came last, or since it was found
  std::string message;  // why it is lost, or what is odd about its end; empty otherwise
};

struct Snapshot {
  std::uint64_t sequence = 0;  // of snapshots, from 1
  SourceState state = SourceState::waiting;
  std::string source;            // the session's URL
  std::string watched;           // for people: the command, or what they asked for
  std::string message;           // why it is lost or ended; empty otherwise
  std::vector<HostView> hosts;   // where all sessions of a relay daemon are followed
  std::int64_t time_ns = 0;      // of the latest event, by its host's clock
  std::int64_t realtime_ns = 0;  // when this was written
  std::int64_t window_ns = 0;    // how far back the window reaches: up to ten seconds
  std::uint64_t events = 0;
  double events_per_second = 0;          // since the snapshot before, or the begin
  std::optional<std::int64_t> delay_ns;  // how old the latest event is; empty: another machine's
  std::optional<std::uint64_t> lost_events = 0;  // empty: packets of unknown content were lost
  std::uint64_t lost_packets = 0;
  analysis::Verdict verdict = analysis::Verdict::not_applicable;
  std::vector<DefectView> defects;
  std::vector<CallbackView> callbacks;
  std::vector<ThreadView> threads;
  std::vector<RuleViolations> violations{};  // of violated rules, the gravest first
  std::vector<VerdictView> verdicts;         // the gravest first
  std::uint64_t verdicts_left_out = 0;
  std::vector<VerdictChange> changes;
};

std::string_view label(SourceState state) noexcept;

}  // namespace cie::live
