#include <cie/analysis/report_rows.hpp>

#include <algorithm>

namespace cie::analysis {

template <typename Rows>
ReportRows::Places ReportRows::places_of(const Rows& rows) {
  Places places;
  places.reserve(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto number = at(rows[i].index);
    if (number >= places.size()) places.resize(number + 1);
    if (places[number] == 0) places[number] = i + 1;
  }
  return places;
}

template <typename Rows, typename Index>
auto ReportRows::find(const Rows& rows, const Places& places, Index index) noexcept -> const
    typename Rows::value_type* {
  const auto number = at(index);
  return number < places.size() && places[number] != 0 ? &rows[places[number] - 1] : nullptr;
}

ReportRows::ReportRows(const Report& report)
    : report_(report),
      processes_(places_of(report.processes)),
      threads_(places_of(report.threads)),
      callbacks_(places_of(report.callbacks)) {}

const ProcessReport* ReportRows::find(ProcessIndex index) const noexcept {
  return find(report_.processes, processes_, index);
}

const ThreadReport* ReportRows::find(ThreadIndex index) const noexcept {
  return find(report_.threads, threads_, index);
}

const CallbackReport* ReportRows::find(CallbackIndex index) const noexcept {
  return find(report_.callbacks, callbacks_, index);
}

const ProcessReport& ReportRows::process(ProcessIndex index) const noexcept {
  static const ProcessReport none;
  const auto* row = find(index);
  return row != nullptr ? *row : none;
}

std::optional<TimeWindow> asked_window(const TraceSummary& trace) noexcept {
  if (!trace.recording_begin || !trace.begin || !trace.end) return std::nullopt;
  return TimeWindow{.from = *trace.begin, .to = *trace.end};
}

const HostReport& host_of(const Report& report, const ProcessReport& process) noexcept {
  static const HostReport none;
  const auto number = at(process.host_index);
  return number < report.hosts.size() ? report.hosts[number] : none;
}

std::string pid_words(std::int64_t pid, std::uint32_t program) {
  auto words = "pid " + std::to_string(pid);
  return program == 0 ? words : words + ", program " + std::to_string(program);
}

std::string pid_words(const ProcessReport& process) {
  return pid_words(process.pid, process.program);
}

std::string ordinal(std::string_view what, std::uint32_t number) {
  if (number < 2) return {};
  return " (" + std::string(what) + ' ' + std::to_string(number) + ')';
}

std::string ordinal(const CallbackReport& callback) {
  return ordinal("lifetime", callback.lifetime);
}

TimeWindow life_of(const CallbackReport& callback, const ProcessReport& process) noexcept {
  return {.from = std::max(callback.lived.from, process.lived.from),
          .to = std::min(callback.lived.to, process.lived.to)};
}

std::optional<TakenMessages> taken_unrecorded(const Report& report) noexcept {
  TakenMessages taken;
  for (const auto& edge : report.edges) {
    taken.messages += edge.messages;
    taken.unrecorded += edge.unrecorded.value_or(0);
  }
  return taken.unrecorded == 0 ? std::nullopt : std::optional(taken);
}

bool is_isolated_executor_alone(const ProcessReport& process) noexcept {
  return process.executor == label(ExecutorKind::isolated);
}

// The kinds of several are joined: "isolated+events".
bool has_isolated_executor(const ProcessReport& process) noexcept {
  return process.executor &&
         process.executor->find(label(ExecutorKind::isolated)) != std::string::npos;
}

std::optional<std::int64_t> at_most_where_unknown(const CallbackReport& callback) noexcept {
  const auto& lower = callback.response_time_lower;
  const auto& upper = callback.response_time_upper;
  if (!lower || !upper || upper->count < lower->count) return std::nullopt;
  return upper->max;
}

std::optional<LongestResponse> longest_response(const CallbackReport& callback) noexcept {
  const auto& exact = callback.response_time;
  const auto& lower = callback.response_time_lower;
  if (!exact && !lower) return std::nullopt;
  if (!lower) return LongestResponse{.ns = exact->max, .is_bound = false};
  if (!exact) return LongestResponse{.ns = lower->max, .is_bound = true};
  const auto most = at_most_where_unknown(callback);
  return LongestResponse{.ns = std::max(exact->max, lower->max),
                         .is_bound = !most || *most > exact->max};
}

double times_deadline(const CallbackReport& callback) noexcept {
  const auto longest = longest_response(callback);
  if (callback.late.value_or(0) == 0 || !longest || callback.response_deadline->ns <= 0) return 0;
  return static_cast<double>(longest->ns) / static_cast<double>(callback.response_deadline->ns);
}

}  // namespace cie::analysis
