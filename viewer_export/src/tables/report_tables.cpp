#include "report_tables.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/rule_pages.hpp>
#include <cie/tracepoints/schema.hpp>

#include "words/callback_names.hpp"
#include "words/recording_words.hpp"
#include "words/text_layout.hpp"
#include "words/verify_words.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackReport;
using analysis::ChainReport;
using analysis::Rare;
using analysis::Report;
using analysis::Summary;
using analysis::ThreadReport;

// Beyond this many chains that no spec names only the slowest are printed; the JSON has all.
constexpr std::size_t kChainsShown = 20;

TextCell duration_cell(const Rare<Summary>& summary, std::int64_t Summary::*part) {
  return summary ? TextCell{format_duration((*summary).*part)} : not_measured();
}

// Where no response time is known exactly, what else says how long and how often it runs.
std::vector<TextCell> callback_row(const CallbackReport& c, const MissedCells& missed,
                                   bool has_bounds_alone) {
  // Neither for what never ran, nor where it is not known.
  const auto isolated = c.is_isolated() ? TextCell{"yes", Look::good}
                        : c.isolation == analysis::Isolation::not_isolated
                            ? TextCell{"NO", Look::bad}
                            : not_measured();
  return {{printable(c.logical_id)},
          {whole_and_other(c.instances, c.partly_seen())},
          has_bounds_alone ? duration_cell(c.inter_arrival, &Summary::p50) : not_measured(),
          response_cell(c, &Summary::p50, format_duration),
          response_cell(c, &Summary::p99, format_duration),
          response_cell(c, &Summary::max, format_duration),
          at_most_cell(c, format_duration),
          c.response_deadline ? TextCell{format_duration(c.response_deadline->ns)} : not_measured(),
          late_runs_cell(c),
          has_bounds_alone ? duration_cell(c.duration, &Summary::max) : not_measured(),
          duration_cell(c.start_latency, &Summary::max),
          duration_cell(c.execution_time, &Summary::max),
          missed.of(c),
          isolated};
}

// What the scheduler was told: "FIFO 80", "OTHER nice 5", "DEADLINE 2.000 ms/10.00 ms".
std::string policy_text(const analysis::ThreadSchedReport& s) {
  constexpr std::string_view kPrefix = "SCHED_";
  std::string_view name = s.policy_name;
  if (name.starts_with(kPrefix)) {
    name.remove_prefix(kPrefix.size());
  }
  std::string text = name.empty() ? fmt::format("policy {}", s.policy) : elide(printable(name), 10);
  if (s.runtime_ns > 0) {
    return text + fmt::format(" {}/{}", format_duration(analysis::signed_ns(s.runtime_ns)),
                              format_duration(analysis::signed_ns(s.period_ns)));
  }
  if (s.priority > 0) {
    return text + fmt::format(" {}", s.priority);
  }
  return s.nice != 0 ? text + fmt::format(" nice {}", s.nice) : text;
}

TextCell scheduling_cell(const ThreadReport& t) {
  if (t.sched) {
    const bool is_refused = t.sched->error != 0;
    return {policy_text(*t.sched) + (is_refused ? " (refused)" : ""),
            is_refused ? Look::bad : Look::plain};
  }
  if (!t.switched) return not_measured();
  return {t.switched->text + (t.switched->changes > 0 ? " (changed)" : "")};
}

std::vector<TextCell> thread_row(const ThreadReport& t, const CallbackNames& names) {
  const auto callbacks = t.callbacks.empty() ? not_measured()
                         : t.callbacks.size() == 1
                             ? TextCell{names.of_id(t.callbacks.front())}
                             : TextCell{counted(t.callbacks.size(), "callback")};
  return {{elide(printable(t.name.empty() ? std::string_view("(unnamed)") : t.name), 24)},
          {fmt::format("{}", t.tid)},
          t.role ? TextCell{std::string(label(*t.role))} : not_measured(),
          scheduling_cell(t),
          t.sched ? TextCell{elide(format_cpus(t.sched->cpus), 10)} : not_measured(),
          t.busy_ns ? TextCell{format_duration(*t.busy_ns)} : not_measured(),
          callbacks};
}

// Runs of rows of the same process become one table each.
template <typename Rows, typename MakeTable, typename MakeRow>
std::string tables_by_process(std::string_view what, const Report& report, const Rows& rows,
                              const TextStyle& style, MakeTable make_table, MakeRow make_row) {
  const analysis::ReportRows by_number(report);
  std::string text;
  for (auto first = rows.begin(); first != rows.end();) {
    const auto last = std::find_if(first, rows.end(),
                                   [&](const auto& row) { return row.process != first->process; });
    TextTable table = make_table();
    std::for_each(first, last, [&](const auto& row) { table.add(make_row(row)); });
    table.drop_columns_of(kNotMeasured);
    const auto title = fmt::format("{} of {}", what, process_title(by_number.process_of(*first)));
    text += paint(cut(title, style.columns, gap(style)), Look::strong, style) + "\n" +
            table.render(style) + "\n";
    first = last;
  }
  return text;
}

// With how many of `all` it is of, where not of all.
std::string of_how_many(std::string_view name, const Rare<Summary>& summary, std::uint64_t all) {
  if (!summary || summary->count >= all) return std::string(name);
  return fmt::format("{} ({} of {})", name, summary->count, all);
}

// Nothing for what is not measured.
void add_quantity(TextTable& table, std::string_view name, const Rare<Summary>& summary) {
  if (!summary) return;
  table.add({{std::string(name)},
             {fmt::format("{}", summary->count)},
             duration_cell(summary, &Summary::min),
             duration_cell(summary, &Summary::p50),
             duration_cell(summary, &Summary::p99),
             duration_cell(summary, &Summary::max)});
}

// ROS 2's events do not tell releases of its first callback, so that they divide no hop.
bool is_by_starts(const ChainReport& chain) {
  return chain.from_start && (!chain.path_latency || chain.path_latency->count < chain.instances);
}

// What the table leaves open, and how its rows add up then.
std::vector<std::string> chain_notes(const ChainReport& chain) {
  if (chain.instances == 0) {
    return {
        "no instance of it was seen: a callback of it never ran, or no message leads from one to "
        "the next (cie verify --explain Q2)"};
  }
  std::vector<std::string> notes;
  const auto measured = chain.path_latency ? chain.path_latency->count : 0;
  if (is_by_starts(chain)) {
    const auto bounded = chain.path_latency_upper ? chain.path_latency_upper->count : 0;
    notes.push_back(fmt::format(
        "the first release is not known: \"at least\" is from the first start{}. Callbacks count from "
        "start to publish, messages from publish to start: the rows add up to \"at least\"",
        bounded == 0 ? "" : ", \"at most\" from what the release was not before"));
    if (bounded != 0 && bounded < chain.instances) {
      notes.emplace_back(
          "\"at most\" leaves instances out that nothing bounds from above; they may be the "
          "longest");
    }
  } else if (measured < chain.instances) {
    notes.push_back(
        fmt::format("path latency of {} of {}: the first release of the others is not "
                    "known, or the clocks of their hosts cannot be related",
                    measured, counted(chain.instances, "instance")));
  }
  if (chain.undivided && !is_by_starts(chain)) {
    notes.push_back(fmt::format(
        "a release is not known on {} of them: from the publish before it to the one after it "
        "their time is in \"not divided\"; the sums of all rows add up to the path latency's",
        chain.undivided->count));
  }
  if (chain.clock_error) {
    notes.push_back(fmt::format("between hosts: add {} for their clocks",
                                format_clock_error(*chain.clock_error)));
  }
  return notes;
}

// Chains of several hosts may have the same name.
std::string chain_place(const Report& report, const ChainReport& chain) {
  if (report.trace.hosts.size() < 2 || !chain.process) return {};
  const auto& process = analysis::ReportRows(report).process(*chain.process);
  return fmt::format(" ({} on {})", pid_words(process), printable(process.host));
}

// " (pid 4001)", where there are several processes.
std::string place_of(const Report& report, const CallbackReport& callback) {
  if (report.processes.size() < 2) return {};
  const auto& process = analysis::ReportRows(report).process_of(callback);
  const auto host = report.trace.hosts.size() > 1 ? " on " + printable(process.host) : "";
  return fmt::format(" ({}{})", pid_words(process), host);
}

// With the host where the chain passes from one to another.
std::string hop_title(const Report& report, const ChainReport& chain, std::size_t hop,
                      const CallbackNames& names) {
  const auto& id = chain.hop_table[hop].from;
  const auto callback = chain.hop_table[hop].from_callback;
  const bool is_split = report.trace.hosts.size() > 1 && !chain.process && callback;
  const auto* row = is_split ? analysis::ReportRows(report).find(*callback) : nullptr;
  return names.of_id(id) + (row == nullptr ? "" : place_of(report, *row));
}

// `said`: notes of the tables before it, which need no repetition.
std::string chain_table(const Report& report, const ChainReport& chain, const CallbackNames& names,
                        const TextStyle& style, std::set<std::string>& said) {
  const auto name = "Chain " + names.of(chain) + chain_place(report, chain) + ':';
  const auto counts = fmt::format("{}, {} complete", counted(chain.hops.size(), "callback"),
                                  counted(chain.instances, "instance"));
  const bool is_line = display_width(name) + 1 + display_width(counts) <= style.columns;
  const auto title = elide(name, style.columns) + (is_line ? " " : "\n  ") + counts;
  TextTable table({{"", "", TextTable::Align::left},
                   {"count", ""},
                   {"min", ""},
                   {"p50", ""},
                   {"p99", ""},
                   {"max", ""}});
  const bool by_starts = is_by_starts(chain);
  const auto add_latency = [&](std::string_view what, const Rare<Summary>& latency) {
    add_quantity(table, of_how_many(what, latency, chain.instances), latency);
  };
  add_latency("path latency", chain.path_latency);
  if (by_starts) {
    add_latency("path latency, at least", chain.from_start);
    add_latency("  at most", chain.path_latency_upper);
  }
  add_quantity(table, "reaction time", chain.reaction_time);
  add_quantity(table, "data age", chain.data_age);
  for (std::size_t i = 0; i < chain.hop_table.size(); ++i) {
    const auto& hop = chain.hop_table[i];
    add_quantity(table, "in " + hop_title(report, chain, i, names),
                 by_starts ? hop.start_to_publish : hop.processing);
    if (hop.to) {
      add_quantity(table, hop.clock_error ? "  message to another host" : "  message to the next",
                   by_starts ? hop.publish_to_start : hop.communication);
    }
  }
  if (!by_starts) add_quantity(table, "not divided", chain.undivided);
  add_quantity(table, "response to the client", chain.response);
  std::string text =
      paint(title, Look::strong, style) + "\n" + (table.is_empty() ? "" : table.render(style));
  for (const auto& note : chain_notes(chain)) {
    if (!said.insert(note).second) continue;
    for (const auto& line : wrap(note, style.columns - 2))
      text += "  " + line + "\n";
  }
  return text + "\n";
}

// Why there are no chains, or fewer than there might be. ROS 2's tracers tell which message a
// callback took since Humble, whose tracetools is 4.
std::string messages_note(const Report& report) {
  constexpr int kFirstThatTells = 4;
  std::size_t processes = 0;
  std::size_t silent = 0;
  std::set<std::string> versions;
  for (const auto& process : report.processes) {
    if (!process.tells_messages) continue;
    ++processes;
    if (*process.tells_messages) continue;
    ++silent;
    if (process.tracetools) versions.insert(printable(*process.tracetools));
  }
  if (silent == 0) return {};
  const bool is_old = !versions.empty() && std::ranges::all_of(versions, [](const auto& version) {
    return std::atoi(version.c_str()) < kFirstThatTells;
  });
  auto text = silent == processes
                  ? std::string("Nothing tells")
                  : fmt::format("In {} of {} processes nothing tells", silent, processes);
  text += " which message a callback took, so no chain leads through what ";
  text += is_old ? fmt::format("tracetools {} recorded: ROS 2 Humble and later tell it.",
                               fmt::join(versions, ", "))
                 : std::string("they took: ros2:rmw_take would tell it.");
  return text;
}

std::string clock_line(const analysis::HostClockReport& pair) {
  constexpr std::size_t kName = 40;
  const auto first = elide(printable(pair.first), kName);
  const auto second = elide(printable(pair.second), kName);
  auto text = fmt::format("{} to {}: {}, {} back; ", first, second,
                          counted(pair.messages_there, "message"), pair.messages_back);
  if (!pair.ahead_ns && pair.fastest_there_ns && pair.fastest_back_ns)
    return text + "one of their clocks was set meanwhile, so they did not keep one difference";
  if (!pair.ahead_ns) {
    return text + "their clocks may differ by anything, because messages go only one way";
  }
  if (*pair.error_ns < 0) {
    return text + fmt::format(
                      "their clocks did not keep one difference: the fastest message there "
                      "and the fastest back took {} together",
                      format_duration(2 * *pair.error_ns));
  }
  return text + fmt::format("the clock of {} is {} ahead, give or take {}", second,
                            format_duration(*pair.ahead_ns), format_duration(*pair.error_ns));
}

// Their names, a few: what did not run has no numbers.
std::string without_runs(const std::vector<std::string>& callbacks, std::string_view what,
                         const TextStyle& style) {
  if (callbacks.empty()) return {};
  constexpr std::size_t kNamed = 4;
  auto text = paint(fmt::format("{} {}", counted(callbacks.size(), "callback"), what), Look::strong,
                    style) +
              "\n";
  for (std::size_t i = 0; i < std::min(kNamed, callbacks.size()); ++i)
    text += "  " + elide(callbacks[i], style.columns - 2) + "\n";
  if (callbacks.size() > kNamed)
    text += fmt::format("  and {} more; --format csv has all\n", callbacks.size() - kNamed);
  return text + "\n";
}

}  // namespace

std::string process_title(const analysis::ProcessReport& process) {
  auto text = pid_words(process);
  text += process.name.empty() ? "" : " \"" + printable(process.name) + "\"";
  text += process.host.empty() ? "" : " on " + printable(process.host);
  text += process.executor ? ", " + printable(*process.executor) + " executor" : "";
  return text + (process.complete ? "" : ", recorded incompletely");
}

std::string callback_title(const Report& report, const CallbackReport& callback) {
  return printable(callback.logical_id) + place_of(report, callback);
}

bool is_lower_bound(const CallbackReport& callback, std::int64_t Summary::*part) {
  if (!callback.response_time_lower) return false;
  if (part == &Summary::p50 && callback.is_median_known == true) return false;
  return part != &Summary::max || analysis::longest_response(callback)->is_bound;
}

TextCell response_cell(const CallbackReport& callback, std::int64_t Summary::*part,
                       std::string (*format)(std::int64_t ns)) {
  const auto longest = analysis::longest_response(callback);
  if (!longest) return not_measured();
  const auto& all = *callback.response_time_or_bound();
  const auto text = format(part == &Summary::max ? longest->ns : all.*part);
  return is_lower_bound(callback, part) ? TextCell{">" + text, Look::doubtful} : TextCell{text};
}

std::optional<std::int64_t> longest_at_most(const CallbackReport& callback) {
  const auto longest = analysis::longest_response(callback);
  const auto most = analysis::at_most_where_unknown(callback);
  if (!most || (longest && !longest->is_bound)) return std::nullopt;
  return std::max(*most, callback.response_time ? callback.response_time->max : *most);
}

TextCell at_most_cell(const CallbackReport& callback, std::string (*format)(std::int64_t ns)) {
  const auto most = longest_at_most(callback);
  return most ? TextCell{"<" + format(*most), Look::doubtful} : not_measured();
}

std::string whole_and_other(std::uint64_t whole, std::uint64_t other) {
  return other > 0 ? fmt::format("{}+{}", whole, other) : fmt::format("{}", whole);
}

TextCell late_runs_cell(const CallbackReport& callback) {
  if (!callback.late) return not_measured();
  const auto open = callback.late_open.value_or(0);
  return {whole_and_other(*callback.late, open),
          *callback.late + open > 0 ? Look::bad : Look::plain};
}

MissedCells::MissedCells(const analysis::VerdictReport* verdicts) {
  if (verdicts != nullptr)
    too_many_ = callbacks_violating(*verdicts, analysis::kNoMissedReleaseRule);
}

TextCell MissedCells::of(const CallbackReport& callback) const {
  if (!callback.missed_releases) return not_measured();
  const bool is_bad = too_many_.contains(static_cast<std::uint32_t>(callback.index));
  return {fmt::format("{}", *callback.missed_releases), is_bad ? Look::bad : Look::plain};
}

bool is_any_thread_shared(const Report& report) {
  return std::ranges::any_of(report.threads,
                             [](const auto& thread) { return thread.callbacks.size() > 1; });
}

std::ptrdiff_t callbacks_with(const Report& report, analysis::Isolation isolation) {
  return std::ranges::count(report.callbacks, std::optional(isolation), &CallbackReport::isolation);
}

std::string callback_tables(const Report& report, const analysis::VerdictReport* verdicts,
                            const TextStyle& style) {
  std::vector<CallbackReport> that_ran;
  std::vector<std::string> unseen;  // nothing of their runs is in the recording
  std::vector<std::string> others;
  for (const auto& callback : report.callbacks) {
    if (callback.has_run()) {
      that_ran.push_back(callback);
    } else {
      (callback.never_ran() ? others : unseen).push_back(callback_title(report, callback));
    }
  }
  const bool has_bounds_alone = std::ranges::none_of(
      that_ran, [](const auto& callback) { return callback.response_time.has_value(); });
  const MissedCells missed(verdicts);
  auto text = tables_by_process(
      "Callbacks", report, that_ran, style,
      [] {
        return TextTable({{"", "callback", TextTable::Align::left},
                          {"", "count"},
                          {"", "every"},
                          {"response", "time p50", TextTable::Align::right, 2},
                          {"response", "time p99"},
                          {"response", "time max"},
                          {"response", "at most"},
                          {"", "deadline"},
                          {"", "late"},
                          {"duration", "max"},
                          {"start", "lat. max", TextTable::Align::right, 1},
                          {"exec.", "time max"},
                          {"", "missed"},
                          {"iso-", "lated"}});
      },
      [has_bounds_alone, &missed](const auto& callback) {
        return callback_row(callback, missed, has_bounds_alone);
      });
  return text + without_runs(unseen, "ran, but in nothing of what was recorded", style) +
         without_runs(others, "never ran", style);
}

std::string thread_tables(const Report& report, const TextStyle& style) {
  const CallbackNames names(report, style);
  return tables_by_process(
      "Threads", report, report.threads, style,
      [] {
        return TextTable({{"thread", "", TextTable::Align::left},
                          {"tid", ""},
                          {"role", "", TextTable::Align::left},
                          {"scheduling", "", TextTable::Align::left},
                          {"CPUs", "", TextTable::Align::left},
                          {"busy", ""},
                          {"callback", "", TextTable::Align::left}});
      },
      [&names](const auto& thread) { return thread_row(thread, names); });
}

std::string clock_lines(const Report& report, const TextStyle& style) {
  if (report.clocks.empty()) return {};
  auto text = paint("Clocks of the hosts", Look::strong, style) + "\n";
  for (const auto& pair : report.clocks) {
    for (const auto& line : wrap(clock_line(pair), style.columns - 2))
      text += "  " + line + "\n";
  }
  return text + "\n";
}

std::string chain_tables(const Report& report, const TextStyle& style) {
  std::vector<const ChainReport*> chains;
  for (const auto& chain : report.chains) {
    chains.push_back(&chain);
  }
  const auto latency = [](const ChainReport* c) {
    if (c->path_latency) return c->path_latency->max;
    return c->from_start ? c->from_start->max : -1;
  };
  // Those of a spec were asked for, each of them.
  const bool is_specified = std::ranges::any_of(report.chains, &ChainReport::is_specified);
  if (chains.size() > kChainsShown && !is_specified) {
    std::ranges::stable_sort(chains, std::greater{}, latency);
    chains.resize(kChainsShown);
  }
  const CallbackNames names(report, style);
  std::string text;
  std::set<std::string> said;
  for (const auto* chain : chains) {
    text += chain_table(report, *chain, names, style, said);
  }
  if (chains.size() < report.chains.size()) {
    text += fmt::format("The {} slowest of {} chains are shown; --format json has all.\n\n",
                        chains.size(), report.chains.size());
  }
  for (const auto& note :
       {messages_note(report), unsent_messages(report), unrecorded_publishers(report)}) {
    if (note.empty()) continue;
    for (const auto& line : wrap(note, style.columns))
      text += line + "\n";
    text += "\n";
  }
  return text;
}

}  // namespace cie::viewer_export
