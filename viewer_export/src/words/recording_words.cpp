#include "recording_words.hpp"

#include <cie/analysis/report_rows.hpp>

#include "text_layout.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>

#include <fmt/format.h>

namespace cie::viewer_export {

std::vector<std::string> sentences_of(const analysis::RecordingReport& recording) {
  std::vector<std::string> sentences;
  if (recording.exit && !recording.command.empty()) {
    sentences.push_back(printable(recording.command.front()) + ' ' + describe(*recording.exit));
  }
  if (recording.first_chunk && *recording.first_chunk > 1) {
    sentences.push_back(
        fmt::format("begins with chunk {}: those before are not here", *recording.first_chunk));
  }
  return sentences;
}

namespace {

// By host, of those of which it is known.
std::map<std::string_view, std::int64_t> recorded_by_host(const analysis::Report& report) {
  std::map<std::string_view, std::int64_t> lengths;
  for (const auto& process : report.processes) {
    const auto& recorded = analysis::host_of(report, process).recorded;
    if (recorded) lengths.emplace(process.host, recorded->ns);
  }
  return lengths;
}

std::string in_several_lengths(const std::map<std::string_view, std::int64_t>& lengths,
                               std::size_t named) {
  std::string text;
  if (lengths.size() > named) {
    const auto by_length = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto [least, most] = std::minmax_element(lengths.begin(), lengths.end(), by_length);
    return fmt::format("{} to {} on {}", format_duration(least->second),
                       format_duration(most->second), counted(lengths.size(), "host"));
  }
  for (const auto& [host, length] : lengths) {
    text += fmt::format("{}{} on {}", text.empty() ? "" : ", ", format_duration(length),
                        printable(host));
  }
  return text;
}

}  // namespace

namespace {

// "3 publications on /chatter", "5 publications on 2 topics"; empty: none.
std::string published_by(const std::vector<const analysis::ProcessReport*>& processes) {
  std::set<std::string_view> topics;
  std::uint64_t publications = 0;
  for (const auto* process : processes) {
    for (const auto& [topic, count] : process->published) {
      topics.insert(topic);
      publications += count;
    }
  }
  if (publications == 0) return {};
  return fmt::format(
      "{} on {}", counted(publications, "publication"),
      topics.size() == 1 ? printable(*topics.begin()) : counted(topics.size(), "topic"));
}

}  // namespace

std::string no_callback_seen(const analysis::Report& report) {
  std::vector<const analysis::ProcessReport*> own;
  std::vector<const analysis::ProcessReport*> of_ros2;
  for (const auto& process : report.processes)
    (process.executor ? own : of_ros2).push_back(&process);
  if (!own.empty()) {
    return fmt::format(
        "No callback was seen: {} began and announced none. A node of rclcpp may have only those that "
        "rclcpp serves for itself (parameters, /parameter_events, /clock, lifecycle services); they "
        "are not listed.",
        counted(own.size(), "process", "processes"));
  }
  if (!of_ros2.empty()) {
    const auto published = published_by(of_ros2);
    return fmt::format(
        "No callback was seen: the ROS 2 events show {}{}{}, but no callback. Callbacks of rclpy have no "
        "events; those of rclcpp have ros2:rclcpp_*_callback_added and ros2:callback_*.",
        counted(of_ros2.size(), "process", "processes"), published.empty() ? "" : " and ",
        published);
  }
  return "No callback was seen: the trace holds no callback_init or callback_start event with the "
         "context vpid. Were the tracepoints of cie, or those of ros2_tracing, enabled when it was "
         "recorded?";
}

std::string name_of_recording(const analysis::Report& report, std::size_t most,
                              std::string_view gap) {
  const auto& paths = report.trace.paths;
  if (paths.empty()) return {};
  std::filesystem::path path = paths.front();
  if (!path.has_filename()) path = path.parent_path();
  auto name = elide(printable(path.filename().string()), most, gap);
  if (paths.size() > 1) name += fmt::format(" and {} more", paths.size() - 1);
  return name;
}

std::string length_of(const analysis::Report& report, std::size_t named) {
  const auto& trace = report.trace;
  const auto hosts = trace.hosts.size();
  const auto lengths = recorded_by_host(report);
  std::set<std::string> different;
  for (const auto& [host, length] : lengths)
    different.insert(format_duration(length));
  if (hosts > 1 && different.size() > 1) return in_several_lengths(lengths, named);
  std::string text = hosts > 1 && different.size() == 1 ? *different.begin()
                     : trace.begin && trace.end ? format_duration((*trace.end - *trace.begin).ns)
                                                : std::string("unknown length");
  if (hosts > named) return text + " on " + counted(hosts, "host");
  for (std::size_t i = 0; i < hosts; ++i)
    text += (i == 0 ? " on " : ", ") + printable(trace.hosts[i]);
  return text;
}

std::optional<bool> is_complete(const analysis::Report& report) {
  if (report.trace.complete) return true;
  const bool is_known =
      std::ranges::any_of(report.defects,
                          [](const auto& defect) {
                            // Gaps between context switches cost no event of applications.
                            return defect.severity != analysis::Severity::info &&
                                   defect.kind != analysis::DefectKind::sched_switch_gaps;
                          }) ||
      std::ranges::any_of(report.processes, [](const auto& process) { return !process.complete; });
  return is_known ? std::optional(false) : std::nullopt;
}

std::string name_of_defect(analysis::DefectKind kind, std::uint64_t count,
                           std::string_view advice) {
  if (kind == analysis::DefectKind::recorder_problem)
    return fmt::format("{} ({})", analysis::label(kind), printable(advice));
  return fmt::format("{} x {}", analysis::label(kind), count);
}

std::uint64_t count_of(const analysis::Report& report, analysis::DefectKind kind) {
  std::uint64_t count = 0;
  for (const auto& defect : report.defects)
    count += defect.kind == kind ? defect.count : 0;
  return count;
}

std::string_view unknown_losses(const analysis::Report& report) {
  const auto has = [&report](analysis::DefectKind kind) { return count_of(report, kind) > 0; };
  const bool is_of_recorder = has(analysis::DefectKind::recorder_problem) &&
                              !has(analysis::DefectKind::discarded_packets) &&
                              !has(analysis::DefectKind::damaged_packets);
  return is_of_recorder ? "losses unknown" : "whole packets lost";
}

std::string window_words(const analysis::TimeWindow& window) {
  return fmt::format("the window {}..{} ns ({}) alone", window.from.ns, window.to.ns,
                     format_duration((window.to - window.from).ns));
}

std::vector<std::string> damages_of(const analysis::Report& report, std::string_view gap) {
  constexpr std::size_t kMost = 2;
  std::vector<std::string> damages;
  for (const auto severity : {analysis::Severity::error, analysis::Severity::loss}) {
    for (const auto& defect : report.defects) {
      if (defect.severity != severity) continue;
      damages.push_back(fmt::format("{} x {}: {}", analysis::label(defect.kind), defect.count,
                                    printable(defect.advice)));
    }
  }
  if (damages.size() > kMost) {
    const auto more = damages.size() - kMost + 1;
    damages.resize(kMost - 1);
    damages.push_back(fmt::format("{} {}", gap, counted(more, "more defect")));
  }
  return damages;
}

std::string unrecorded_publishers(const analysis::Report& report) {
  const auto taken = analysis::taken_unrecorded(report);
  if (!taken) return {};
  return fmt::format("{} of {} taken came from publishers that were not recorded",
                     taken->unrecorded, counted(taken->messages, "message"));
}

std::string unsent_messages(const analysis::Report& report) {
  std::vector<const analysis::UnsentMessages*> publishers;
  std::uint64_t messages = 0;
  for (const auto& process : report.processes) {
    if (!process.unsent) continue;
    for (const auto& publisher : *process.unsent) {
      publishers.push_back(&publisher);
      messages += publisher.messages;
    }
  }
  if (messages == 0) return {};
  std::ranges::stable_sort(publishers, std::ranges::greater{}, &analysis::UnsentMessages::messages);
  std::string on;
  for (const auto* publisher : publishers) {
    on += fmt::format("{}{} on {}", on.empty() ? "" : ", ", publisher->messages,
                      publisher->topic.empty() ? "an unknown topic" : printable(publisher->topic));
  }
  return fmt::format("{} {} not sent in time and reached nobody: {}", counted(messages, "message"),
                     messages == 1 ? "was" : "were", on);
}

}  // namespace cie::viewer_export
