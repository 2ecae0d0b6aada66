#include <cie/viewer_export/schedulability_writers.hpp>

#include "schedulability_words.hpp"
#include "screen.hpp"
#include "verify_findings.hpp"
#include "words/recording_words.hpp"
#include "words/text_layout.hpp"
#include "worst_run_words.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackSchedulability;
using analysis::SchedulabilityReport;

class SchedulabilityScreen {
 public:
  SchedulabilityScreen(const SchedulabilityReport& report, const Judged& judged,
                       const TextStyle& style)
      : report_(report), judged_(judged), style_(style), rows_(worst_first(report)) {}

  Lines lines() const {
    constexpr std::size_t kFewest = 2;
    auto lines = head();
    auto below = tail(kMostReasons);
    for (auto most = kMostReasons;
         most-- > 1 && lines.size() + below.size() + kLinesAroundRows + kFewest > style_.lines;)
      below = tail(most);
    const auto taken = lines.size() + below.size() + kLinesAroundRows;
    append(lines, table(std::max(style_.lines - std::min(style_.lines, taken), kFewest)));
    append(lines, std::move(below));
    return lines;
  }

 private:
  static constexpr std::size_t kMostReasons = 3;

  // Below the table, with so many reasons and processors at most.
  Lines tail(std::size_t most) const {
    auto lines = about_worst(most);
    append(lines, undecided_by_bounds(most));
    append(lines, reasons(most));
    append(lines, demands(most));
    append(lines, commands());
    return lines;
  }

  std::string name_of(const CallbackSchedulability& callback) const {
    const auto* row = judged_.rows.find(callback.index);
    return row != nullptr ? judged_.names.of(*row) : printable(callback.logical_id);
  }

  Lines painted(const std::string& text, Look look) const {
    auto lines = wrap(text, style_.columns);
    for (auto& line : lines)
      line = paint(line, look, style_);
    return lines;
  }

  Lines head() const {
    auto lines = painted(outcome(report_), outcome_look(report_));
    if (report_.is_undecided() && !is_reason_told(report_.why_undecided()))
      append(lines, painted(undecided(report_), Look::doubtful));
    append(lines, wrap(measured_window(judged_.report), style_.columns));
    for (const auto& damage : damages_of(judged_.report, gap(style_)))
      append(lines, painted(damage, Look::doubtful));
    return lines;
  }

  // Below the table.
  bool is_reason_told(const std::string& why) const {
    return std::ranges::any_of(report_.callbacks, [&](const auto& callback) {
      return callback.reason == why && !(callback.bound_ns && &callback == told_as_worst());
    });
  }

  // A column that there may be room for.
  struct Extra {
    TextTable::Column column;
    std::string (*cell)(const CallbackSchedulability& callback);
  };

  // The most useful first.
  std::vector<Extra> extras() const {
    const bool has_waiting = std::ranges::any_of(rows_, [](const CallbackSchedulability* callback) {
      return callback->waiting_ns.value_or(0) > 0;
    });
    return {
        {{has_waiting ? "exec.+wait" : "execution", "longest C"},
         [](const CallbackSchedulability& callback) {
           return parameter(callback.execution, compact_duration, callback.waiting_ns.value_or(0));
         }},
        {{"inter-arr.", "shortest T"},
         [](const CallbackSchedulability& callback) {
           return parameter(callback.period, compact_duration);
         }},
        {{"", "policy"}, policy_of},
        {{"", "CPUs"}, [](const CallbackSchedulability& callback) {
           return callback.cpus.empty() ? std::string(kNotMeasured) : format_cpus(callback.cpus);
         }}};
  }

  TextTable table_of(std::size_t rows, const std::vector<Extra>& extras) const {
    using Align = TextTable::Align;
    std::vector<TextTable::Column> columns{{"", "callback", Align::left},
                                           {"", "met", Align::left},
                                           {"deadline", "D"},
                                           {"bound", "R"},
                                           {"observed", "longest"}};
    for (const auto& extra : extras)
      columns.push_back(extra.column);
    TextTable table(std::move(columns));
    for (std::size_t i = 0; i < rows; ++i) {
      const auto& callback = *rows_[i];
      std::vector<TextCell> cells{
          {name_of(callback)},
          standing(callback),
          {callback.deadline ? compact_duration(callback.deadline->ns) : std::string(kNotMeasured)},
          {time_or_dash(callback.bound_ns, compact_duration)},
          {longest_observed(callback, compact_duration)}};
      for (const auto& extra : extras)
        cells.push_back({extra.cell(callback)});
      table.add(std::move(cells));
    }
    table.drop_columns_of(kNotMeasured);
    table.keep_rows_on_one_line();
    return table;
  }

  Lines table(std::size_t room) const {
    if (rows_.empty()) return {"", "  no callback was measured"};
    const auto rows = std::min(rows_.size(), room);
    auto columns = extras();
    const auto shown = [&] { return table_of(rows, columns); };
    auto lines = table_lines(with_room_for(columns, shown, style_), style_);
    if (rows < rows_.size()) {
      lines.push_back(
          fmt::format("  {} {}", gap(style_), counted(rows_.size() - rows, "more callback")));
    }
    return lines;
  }

  // Why the worst of what was found is as it is, and what to do about it.
  Lines about_worst(std::size_t most) const {
    if (!report_.has_finding()) return {};
    const auto& worst = *rows_.front();
    const auto why = worst.has_missed_deadline() ? why_missed(worst)
                     : worst.is_flagged          ? why_flagged(worst)
                                                 : why_not_guaranteed(worst);
    auto lines = paragraph("  worst: ", name_of(worst) + ", " + why, most, style_);
    append(lines, paragraph(style_.unicode ? "  → " : "  -> ", remedy(worst), 2, style_));
    return lines;
  }

  std::string_view remedy(const CallbackSchedulability& worst) const {
    if (worst.is_flagged && !worst.has_missed_deadline())
      return "look what ran meanwhile: cie export --to perfetto";
    const auto* row = judged_.rows.find(worst.index);
    if (row != nullptr && row->isolation == analysis::Isolation::not_isolated)
      return "shorten it, or give it a thread of its own";
    if (worst.policy == "SCHED_DEADLINE") {
      return is_admission_doubtful(worst)
                 ? "reserve less of its CPUs, or give it others"
                 : "shorten it, give it more runtime, or release it less often";
    }
    return worst.policy.empty() || has_fixed_priority(worst)
               ? "shorten it or what is as urgent, raise its priority, or give it a CPU"
               : "shorten it, or give it SCHED_FIFO and a priority";
  }

  // The EDF test of its CPUs does not show that deadlines are met.
  bool is_admission_doubtful(const CallbackSchedulability& callback) const {
    return std::ranges::any_of(report_.deadline, [&callback](const auto& admission) {
      return admission.is_guaranteed == false &&
             std::ranges::find_first_of(admission.cpus, callback.cpus) != admission.cpus.end();
    });
  }

  std::string why_missed(const CallbackSchedulability& worst) const {
    const auto* row = judged_.rows.find(worst.index);
    const auto* run = row == nullptr ? nullptr : worst_run_of(judged_, *row);
    auto went = run == nullptr ? std::string() : where_time_went(judged_, *run);
    if (!went.empty()) return went;
    return "took " + format_excess(worst.longest_ns(), worst.deadline->ns);
  }

  std::string why_flagged(const CallbackSchedulability& worst) const {
    std::string text;
    for (const auto& sentence : why_above(worst))
      text += (text.empty() ? "" : " ") + in_names(sentence);
    return text;
  }

  std::string why_not_guaranteed(const CallbackSchedulability& worst) const {
    if (!worst.bound_ns) return "no bound: " + in_names(worst.reason);
    const auto own = worst.execution->ns;
    auto text =
        fmt::format("R {}: {} of its own", format_duration(*worst.bound_ns), format_duration(own));
    if (worst.method == analysis::BoundMethod::fixed_priority && *worst.bound_ns > own) {
      text += fmt::format(", {} of callbacks that are at least as urgent on CPU {}",
                          format_duration(*worst.bound_ns - own), format_cpus(worst.cpus));
    }
    return text;
  }

  std::string in_names(const std::string& reason) const {
    return judged_.names.in_words(printable(reason));
  }

  // `of_several`: what is said of the one that is named.
  std::string names_of(const CommonReason& common, std::string_view of_several) const {
    const auto& callbacks = common.callbacks;
    auto name = name_of(*callbacks.front());
    if (callbacks.size() == 1) return name;
    auto count = counted(callbacks.size(), "callback");
    return of_several.empty() ? count : fmt::format("{}, {} {}", count, of_several, name);
  }

  // What is said of it stands above.
  const CallbackSchedulability* told_as_worst() const {
    const bool is_told = report_.has_finding() && !rows_.front()->has_missed_deadline();
    return is_told ? rows_.front() : nullptr;
  }

  // Without what stands above.
  std::vector<CommonReason> untold(std::vector<CommonReason> all) const {
    for (auto& common : all)
      std::erase(common.callbacks, told_as_worst());
    std::erase_if(all, [](const CommonReason& common) { return common.callbacks.empty(); });
    return all;
  }

  static std::uint64_t callbacks_of(const std::vector<CommonReason>& reasons) {
    std::uint64_t count = 0;
    for (const auto& common : reasons)
      count += common.callbacks.size();
    return count;
  }

  // How many callbacks are told of by none of `shown`.
  Lines rest(const std::vector<CommonReason>& all, const std::vector<CommonReason>& shown,
             std::string_view what) const {
    const auto left = callbacks_of(all) - callbacks_of(shown);
    if (left == 0) return {};
    return {fmt::format("  {} {} more {}", gap(style_), left, what)};
  }

  Lines undecided_by_bounds(std::size_t most) const {
    const auto all = untold(undecided_by_bound(report_, Sameness::alike));
    auto shown = all;
    if (shown.size() > most) shown.resize(most);
    const std::size_t lines_of_each = most < kMostReasons ? 1 : 3;
    Lines lines;
    for (const auto& common : shown) {
      append(lines, paragraph("  undecided: ",
                              names_of(common, "worst") + ": " + in_names(common.reason()),
                              lines_of_each, style_));
    }
    append(lines, rest(all, shown, "undecided"));
    return lines;
  }

  static bool has_deadline(const CommonReason& without) {
    return std::ranges::any_of(without.callbacks,
                               [](const auto* callback) { return callback->deadline.has_value(); });
  }

  // Where there are deadlines, of callbacks that have one.
  Lines reasons(std::size_t most) const {
    const auto all = untold(without_bound(report_, Sameness::alike));
    const auto* told = told_as_worst();
    auto shown = all;
    if (report_.deadlines() > 0)
      std::erase_if(shown, [](const CommonReason& without) { return !has_deadline(without); });
    if (shown.size() > most) shown.resize(most);
    const std::size_t lines_of_each = most < kMostReasons ? 1 : shown.size() == 1 ? 3 : 2;
    Lines lines;
    for (const auto& without : shown) {
      const bool is_told =
          told != nullptr && without.is_equal() && without.reason() == told->reason;
      const auto why = is_told ? "for the same reason" : in_names(without.reason());
      const auto names = names_of(without, without.is_equal() ? "" : "e.g.");
      append(lines,
             paragraph("  no bound: ", fmt::format("{}: {}", names, why), lines_of_each, style_));
    }
    append(lines, rest(all, shown, "without a bound"));
    return lines;
  }

  Lines demands(std::size_t most) const {
    const auto all = processors(report_);
    Lines lines;
    const auto shown = all.size() > most ? most - 1 : all.size();
    for (std::size_t i = 0; i < shown; ++i)
      append(lines, paragraph("  ", in_names(all[i]), most < kMostReasons ? 1 : 2, style_));
    if (shown < all.size())
      lines.push_back(fmt::format("  {} {} more on CPUs", gap(style_), all.size() - shown));
    return lines;
  }

  Lines commands() const {
    return commands_to_paste(
        {{"all", "cie analyze schedulability " + judged_.context.verify_arguments +
                     (style_.ids ? " --ids" : "") + " --all"},
         judged_.look()},
        style_);
  }

  const SchedulabilityReport& report_;
  const Judged& judged_;
  const TextStyle& style_;
  std::vector<const CallbackSchedulability*> rows_;
};

}  // namespace

void write_schedulability_screen(std::ostream& out, const SchedulabilityReport& report,
                                 const analysis::Report& of,
                                 const analysis::VerdictReport& verdicts,
                                 const VerifyContext& context, const TextStyle& style) {
  const Judged judged(verdicts, of, context, style);
  for (const auto& line : SchedulabilityScreen(report, judged, style).lines())
    out << line << '\n';
}

}  // namespace cie::viewer_export
