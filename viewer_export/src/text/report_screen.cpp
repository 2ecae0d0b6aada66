#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/rule_pages.hpp>
#include <cie/viewer_export/report_writers.hpp>

#include "callback_ranking.hpp"
#include "headline.hpp"
#include "report_head.hpp"
#include "screen.hpp"
#include "tables/report_tables.hpp"
#include "verify_findings.hpp"
#include "words/recording_words.hpp"
#include "words/text_layout.hpp"
#include "worst_run_words.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackReport;
using analysis::ChainReport;
using analysis::Isolation;
using analysis::Rare;
using analysis::Report;
using analysis::Summary;

TextCell time_cell(const Rare<Summary>& times, std::int64_t Summary::*part,
                   std::string_view mark = {}) {
  if (!times) return not_measured();
  return {std::string(mark) + compact_duration((*times).*part),
          mark.empty() ? Look::plain : Look::doubtful};
}

// What a chain's row tells, and what the spec allows of it.
struct ChainTimes {
  std::string_view what;           // behind the name; empty: path latency
  const Summary* times = nullptr;  // null: none was measured
  std::optional<std::int64_t> bound;
};

ChainTimes times_of(const ChainReport& chain, const SchedulingSpec* spec) {
  const SpecChain* entry = nullptr;
  if (spec != nullptr && chain.is_specified) {
    const auto found = std::ranges::find(spec->chains(), chain.name, &SpecChain::name);
    if (found != spec->chains().end()) entry = &*found;
  }
  const bool is_reaction = !chain.path_latency && chain.reaction_time;
  if (is_reaction) {
    return {.what = ", reaction",
            .times = &*chain.reaction_time,
            .bound = entry == nullptr ? std::nullopt : entry->reaction_time_ns};
  }
  return {.what = "",
          .times = chain.path_latency ? &*chain.path_latency : nullptr,
          .bound = entry == nullptr ? std::nullopt : entry->path_latency_ns};
}

bool is_late(const ChainTimes& chain) {
  return chain.times != nullptr && chain.bound && chain.times->max > *chain.bound;
}

// How many is not known where only some were.
TextCell late_cell(const ChainTimes& chain) {
  if (chain.times == nullptr || !chain.bound) return not_measured();
  if (!is_late(chain)) return {"0"};
  return {chain.times->min > *chain.bound ? fmt::format("{}", chain.times->count) : ">0",
          Look::bad};
}

class ReportScreen {
 public:
  ReportScreen(const Judged& judged, const ReportContext& context, const TextStyle& style)
      : judged_(judged),
        missed_(&judged.verdicts),
        report_(judged.report),
        context_(context),
        style_(style),
        gap_(gap(style)),
        claims_(report_head(judged, context)),
        head_(judged_, claims_.findings, style_),
        callbacks_(worst_first(report_)) {
    for (const auto& chain : report_.chains) {
      if (chain.is_specified || times_of(chain, spec()).times != nullptr) chains_.push_back(&chain);
    }
    std::ranges::stable_sort(chains_, std::ranges::greater{}, [this](const auto* chain) {
      const auto times = times_of(*chain, spec());
      return std::pair(is_late(times), times.times == nullptr ? -1 : times.times->max);
    });
    has_durations_alone_ = std::ranges::none_of(callbacks_, [](const auto* callback) {
      return callback->response_time || callback->release_source == analysis::ReleaseSource::wakeup;
    });
  }

  Lines lines() const {
    auto lines = head();
    append(lines, paragraph("  ", recorded(), 3, style_));
    append(lines, unseen_of_spec(judged_, style_));
    append(lines, remarks(judged_, damages_of(report_, gap_), style_));
    if (report_.callbacks.empty()) {
      append(lines, paragraph("  ", no_callback_seen(report_), 3, style_));
      append(lines,
             commands_to_paste(
                 {{"what it holds", "cie events " + context_.verify.view_arguments + " --count"}},
                 style_));
      return lines;
    }
    auto tail = notes();
    append(tail, commands());
    const bool may_have_bounds = std::ranges::any_of(callbacks_, [this](const auto* callback) {
      return has_lower_bound(*callback) || longest_at_most(*callback).has_value();
    });
    const auto taken = lines.size() + tail.size() + kLinesAroundRows + (may_have_bounds ? 1 : 0);
    append(lines, table(style_.lines - std::min(style_.lines, taken)));
    append(lines, std::move(tail));
    return lines;
  }

 private:
  const SchedulingSpec* spec() const { return context_.verify.spec; }

  Lines head() const {
    const auto& fact = claims_.isolation;
    if (!claims_.has_verdict()) return head_.lines_of(fact);
    auto lines = head_.lines();
    const bool is_told = head_.fact().find(fact) != std::string::npos;
    if (!is_told) append(lines, paragraph("  ", fact, 1, style_));
    return lines;
  }

  // "3.186 s on vm: 2 processes, isolated executor; 26 callbacks, 1568 instances, nothing lost".
  std::string recorded() const {
    constexpr std::size_t kNamed = 3;
    auto text = length_of(report_, kNamed);
    text += ": " + counted(report_.processes.size(), "process");
    std::map<std::string, std::size_t> executors;  // how many processes have each
    for (const auto& process : report_.processes) {
      if (process.executor) ++executors[printable(*process.executor)];
    }
    for (const auto& [executor, count] : executors) {
      const auto is_of_all = count == report_.processes.size();
      text += is_of_all ? fmt::format(", {} executor", executor)
                        : fmt::format(", {} with the {} executor", count, executor);
    }
    text += "; " + counted(report_.callbacks.size(), "callback") + ", " + counts_of_runs(report_);
    const auto is_whole = is_complete(report_);
    if (!report_.callbacks.empty() && !is_whole) text += "; whether it is complete is not known";
    if (!report_.callbacks.empty() && is_whole == false) text += "; NOT complete";
    return text;
  }

  enum class Extra : std::uint8_t { at_most, missed, own_thread, start_latency, execution };

  std::vector<TextTable::Column> columns(const std::vector<Extra>& extras) const {
    using Align = TextTable::Align;
    std::vector<TextTable::Column> columns{
        {"", "callback", Align::left},
        {"", "count", Align::right, 1},
        {"", "every", Align::right, 4},
        {has_durations_alone_ ? "duration" : "response time", "p50", Align::right, 3, true},
        {"", "p99", Align::right, 2, true},
        {"", "max"},
        {"", "deadline", Align::right, 1},
        {"", "late"},
        {"", "busy", Align::right, 1}};
    for (const auto extra : extras) {
      columns.push_back(extra == Extra::at_most         ? TextTable::Column{"response", "at most"}
                        : extra == Extra::missed        ? TextTable::Column{"", "missed"}
                        : extra == Extra::own_thread    ? TextTable::Column{"own", "thread"}
                        : extra == Extra::start_latency ? TextTable::Column{"start", "lat. max"}
                                                        : TextTable::Column{"exec.", "time max"});
    }
    return columns;
  }

  // How much of what was recorded of its host it ran, where that is the most that is known.
  TextCell busy_cell(const CallbackReport& callback) const {
    const auto& recorded = analysis::host_of(report_, judged_.rows.process_of(callback)).recorded;
    if (!has_durations_alone_ || !callback.duration || !recorded) return not_measured();
    return {fmt::format("{:.1f}%", 100 * static_cast<double>(callback.duration->sum) /
                                       static_cast<double>(recorded->ns))};
  }

  TextCell extra_cell(const CallbackReport& callback, Extra extra) const {
    switch (extra) {
      case Extra::at_most:
        return at_most_cell(callback, compact_duration);
      case Extra::missed:
        return missed_.of(callback);
      case Extra::own_thread:
        return callback.is_isolated()                          ? TextCell{"yes", Look::good}
               : callback.isolation == Isolation::not_isolated ? TextCell{"NO", Look::bad}
                                                               : not_measured();
      case Extra::start_latency:
        return time_cell(callback.start_latency, &Summary::max);
      case Extra::execution:
        break;
    }
    return time_cell(callback.execution_time, &Summary::max);
  }

  std::vector<TextCell> row_of(const CallbackReport& callback,
                               const std::vector<Extra>& extras) const {
    const auto time = [&](std::int64_t Summary::*part) {
      return has_durations_alone_ ? time_cell(callback.duration, part)
                                  : response_cell(callback, part, compact_duration);
    };
    std::vector<TextCell> cells{
        {judged_.names.of(callback)},
        {whole_and_other(callback.instances, callback.partly_seen())},
        has_durations_alone_ ? time_cell(callback.inter_arrival, &Summary::p50) : not_measured(),
        time(&Summary::p50),
        time(&Summary::p99),
        time(&Summary::max),
        callback.response_deadline ? TextCell{compact_duration(callback.response_deadline->ns)}
                                   : not_measured(),
        late_runs_cell(callback),
        busy_cell(callback)};
    for (const auto extra : extras)
      cells.push_back(extra_cell(callback, extra));
    return cells;
  }

  std::vector<TextCell> row_of(const ChainReport& chain, std::size_t extras) const {
    const auto row = times_of(chain, spec());
    const auto times = row.times == nullptr ? Rare<Summary>() : Rare<Summary>(*row.times);
    const std::string_view mark = chain.clock_error ? "~" : "";
    std::vector<TextCell> cells{{fmt::format("chain {}{}", judged_.names.of(chain), row.what)},
                                {fmt::format("{}", chain.instances)},
                                not_measured(),
                                time_cell(times, &Summary::p50, mark),
                                time_cell(times, &Summary::p99, mark),
                                time_cell(times, &Summary::max, mark),
                                row.bound ? TextCell{compact_duration(*row.bound)} : not_measured(),
                                late_cell(row),
                                not_measured()};
    cells.resize(cells.size() + extras, not_measured());
    return cells;
  }

  TextTable table_of(std::size_t callbacks, std::size_t chains,
                     const std::vector<Extra>& extras) const {
    TextTable table(columns(extras));
    for (std::size_t i = 0; i < callbacks; ++i)
      table.add(row_of(*callbacks_[i], extras));
    for (std::size_t i = 0; i < chains; ++i)
      table.add(row_of(*chains_[i], extras.size()));
    table.drop_columns_of(kNotMeasured);
    table.keep_rows_on_one_line();
    return table;
  }

  // The columns that there may be room for, the most useful first.
  std::vector<Extra> extras() const {
    std::vector<Extra> extras;
    if (std::ranges::any_of(callbacks_, [](const auto* callback) {
          return longest_at_most(*callback).has_value();
        }))
      extras.push_back(Extra::at_most);
    if (missed_releases() > 0) extras.push_back(Extra::missed);
    if (callbacks_with(report_, Isolation::not_isolated) > 0 &&
        callbacks_with(report_, Isolation::isolated) > 0)
      extras.push_back(Extra::own_thread);
    extras.push_back(Extra::start_latency);
    extras.push_back(Extra::execution);
    return extras;
  }

  Lines table(std::size_t room) const {
    const auto chains =
        std::min(chains_.size(), std::max(room / 4, room - std::min(room, callbacks_.size())));
    const auto callbacks = std::min(callbacks_.size(), room - std::min(room, chains));
    if (callbacks + chains == 0) return more_than(0, 0);
    auto columns = extras();
    const auto shown = [&] { return table_of(callbacks, chains, columns); };
    auto lines = table_lines(with_room_for(columns, shown, style_), style_);
    append(lines, more_than(callbacks, chains));
    append(lines, bounds_note(std::span(callbacks_).first(callbacks), columns));
    return lines;
  }

  bool has_lower_bound(const CallbackReport& callback) const {
    return !has_durations_alone_ &&
           (is_lower_bound(callback, &Summary::p99) || is_lower_bound(callback, &Summary::max));
  }

  // What the marks of the rows mean.
  Lines bounds_note(std::span<const CallbackReport* const> shown,
                    const std::vector<Extra>& extras) const {
    const bool has_lower = std::ranges::any_of(
        shown, [this](const auto* callback) { return has_lower_bound(*callback); });
    const bool has_upper = std::ranges::find(extras, Extra::at_most) != extras.end() &&
                           std::ranges::any_of(shown, [](const auto* callback) {
                             return longest_at_most(*callback).has_value();
                           });
    if (!has_lower && !has_upper) return {};
    const std::string_view marks = !has_upper   ? "\">\" at least"
                                   : !has_lower ? "\"<\" at most"
                                                : "\">\" at least, \"<\" at most";
    return paragraph("  response time: ", fmt::format("{}, where a release is not known", marks), 1,
                     style_);
  }

  Lines more_than(std::size_t callbacks, std::size_t chains) const {
    std::string more;
    if (const auto left = callbacks_.size() - callbacks; left > 0)
      more += counted(left, "more callback");
    if (const auto left = chains_.size() - chains; left > 0)
      more += (more.empty() ? "" : ", ") + counted(left, "more chain");
    if (more.empty()) return {};
    return paragraph(fmt::format("  {} ", gap_), more + longer_at_start(callbacks), 1, style_);
  }

  // What leads by the time it took, had it not run at the start alone: "; 7 took longer, up to …".
  std::string longer_at_start(std::size_t callbacks) const {
    using analysis::LongestResponse;
    const auto longest = [](const CallbackReport* callback) {
      return analysis::longest_response(*callback).value_or(LongestResponse{});
    };
    LongestResponse shown;
    for (std::size_t i = 0; i < callbacks; ++i)
      shown.ns = std::max(shown.ns, longest(callbacks_[i]).ns);
    std::size_t count = 0;
    auto most = shown;
    for (auto i = callbacks; i < callbacks_.size(); ++i) {
      const auto here = longest(callbacks_[i]);
      if (here.ns <= shown.ns || !ran_at_start(*callbacks_[i])) continue;
      ++count;
      if (here.ns > most.ns) most = here;
    }
    if (count == 0) return {};
    return fmt::format("; {} of them took longer, up to {}{}: once, or to start others", count,
                       most.is_bound ? ">" : "", compact_duration(most.ns));
  }

  std::uint64_t missed_releases() const {
    std::uint64_t missed = 0;
    for (const auto* callback : callbacks_)
      missed += callback->missed_releases.value_or(0);
    return missed;
  }

  // What the table's rows do not say.
  Lines notes() const {
    Lines lines;
    const auto* worst = callbacks_.empty() ? nullptr : worst_run_of(judged_, *callbacks_.front());
    if (const auto why = worst == nullptr ? std::string() : where_time_went(judged_, *worst);
        !why.empty()) {
      append(lines,
             paragraph("  worst: ", judged_.names.of(*callbacks_.front()) + ", " + why, 2, style_));
    }
    append(lines, counts("releases missed", &CallbackReport::missed_releases));
    append(lines, counts("samples lost", &CallbackReport::lost_samples));
    append(lines, counts("samples overwritten", &CallbackReport::overwritten_samples));
    for (const auto& note : {unsent_messages(report_), unrecorded_publishers(report_)}) {
      if (!note.empty()) append(lines, paragraph("  ", note, 1, style_));
    }
    append(lines, open_runs());
    append(lines, without_runs("no instance seen", [](const CallbackReport& callback) {
             return !callback.has_run() && !callback.never_ran();
           }));
    append(lines, without_runs("never ran", &CallbackReport::never_ran));
    return lines;
  }

  // "  releases missed: 3 of plan timer 20 ms, 1 of map timer 1 s": the most first.
  Lines counts(std::string_view what, std::optional<std::uint64_t> CallbackReport::*count) const {
    const auto number_of = [count](const CallbackReport* callback) {
      return (callback->*count).value_or(0);
    };
    auto counted_ones = callbacks_;
    std::erase_if(counted_ones, [&](const auto* callback) { return number_of(callback) == 0; });
    std::ranges::stable_sort(counted_ones, std::ranges::greater{}, number_of);
    std::string text;
    for (const auto* callback : counted_ones) {
      const bool is_at_least =
          count == &CallbackReport::overwritten_samples && callback->is_overwritten_at_least;
      text += fmt::format("{}{}{} of {}", text.empty() ? "" : ", ", is_at_least ? "at least " : "",
                          number_of(callback), judged_.names.of(*callback));
    }
    if (text.empty()) return {};
    return paragraph(fmt::format("  {}: ", what), text, 1, style_);
  }

  template <typename Is>
  Lines without_runs(std::string_view what, const Is& is) const {
    std::string names;
    std::size_t count = 0;
    for (const auto& callback : report_.callbacks) {
      if (!std::invoke(is, callback)) continue;
      names += (names.empty() ? "" : ", ") + judged_.names.of(callback);
      ++count;
    }
    if (count == 0) return {};
    return paragraph(fmt::format("  {}: {}: ", what, counted(count, "callback")), names, 1, style_);
  }

  // A run that did not end has taken longer than all others of its callback, or than its deadline.
  static bool has_notable_open_run(const CallbackReport& callback) {
    const auto& open = callback.longest_open;
    const auto ended = analysis::longest_response(callback).value_or(analysis::LongestResponse{});
    const auto& deadline = callback.response_deadline;
    return open && (open->until_end.ns > ended.ns || (deadline && open->until_end > *deadline));
  }

  // "plan timer 20 ms, instance 7 began 470.0 ms before the end (deadline 20.00 ms)".
  std::string open_run(const CallbackReport& callback) const {
    const auto& open = *callback.longest_open;
    auto text = fmt::format("{}, instance {} began {} before the end", judged_.names.of(callback),
                            open.seq, format_duration(open.until_end.ns));
    if (const auto& deadline = callback.response_deadline)
      text += fmt::format(" (deadline {})", format_duration(deadline->ns));
    return text;
  }

  // Those that began first, and of how many callbacks there are others.
  Lines open_runs() const {
    constexpr std::size_t kNamed = 2;
    auto open = callbacks_;
    std::erase_if(open, [](const auto* callback) { return !has_notable_open_run(*callback); });
    if (open.empty()) return {};
    std::ranges::stable_sort(open, std::ranges::greater{}, [](const auto* callback) {
      return callback->longest_open->until_end;
    });
    std::string text;
    for (std::size_t i = 0; i < std::min(kNamed, open.size()); ++i)
      text += (i == 0 ? "" : "; ") + open_run(*open[i]);
    if (open.size() > kNamed)
      text += fmt::format("; {} {}", gap_, counted(open.size() - kNamed, "more callback"));
    return paragraph("  did not end: ", text, kNamed + 1, style_);
  }

  Lines commands() const {
    const auto report =
        "cie report " + context_.verify.verify_arguments + (style_.ids ? " --ids" : "");
    std::vector<std::pair<std::string_view, std::string>> all{{"all", report + " --all"},
                                                              {"threads", report + " --threads"}};
    if (!report_.chains.empty()) all.emplace_back("chains", report + " --chains");
    all.emplace_back("rules", "cie verify " + context_.verify.verify_arguments);
    all.push_back(judged_.look());
    constexpr std::size_t kMost = 4;
    auto lines = commands_to_paste(all, style_);
    if (lines.size() <= kMost) return lines;
    // Long ones: what differs in one word is told by the word.
    std::erase_if(
        all, [](const auto& item) { return item.first == "threads" || item.first == "chains"; });
    lines = commands_to_paste(all, style_);
    if (lines.size() > kMost) {
      all.pop_back();
      lines = commands_to_paste(all, style_);
    }
    lines.emplace_back(report_.chains.empty() ? "  in place of --all: --threads"
                                              : "  in place of --all: --threads, --chains");
    return lines;
  }

  const Judged& judged_;
  const MissedCells missed_;
  const Report& report_;
  const ReportContext& context_;
  const TextStyle& style_;
  std::string_view gap_;
  ReportHead claims_;
  Headline head_;
  std::vector<const CallbackReport*> callbacks_;  // that ran, the worst first
  std::vector<const ChainReport*> chains_;        // likewise
  bool has_durations_alone_ = false;              // no release is known
};

}  // namespace

void write_report_screen(std::ostream& out, const Report& report,
                         const analysis::VerdictReport& verdicts, const ReportContext& context,
                         const TextStyle& style) {
  const Judged judged(verdicts, report, context.verify, style);
  for (const auto& line : ReportScreen(judged, context, style).lines())
    out << line << '\n';
}

void write_report_threads(std::ostream& out, const Report& report, const TextStyle& style) {
  out << thread_tables(report, style);
}

void write_report_chains(std::ostream& out, const Report& report, const TextStyle& style) {
  out << chain_tables(report, style);
}

}  // namespace cie::viewer_export
