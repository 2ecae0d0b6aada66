#include "perfetto_enforcement.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/rule_pages.hpp>
#include <cie/tracepoints/utf8.hpp>
#include <cie/viewer_export/sentences.hpp>

#include "words/verify_words.hpp"

#include <map>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace cie::viewer_export::perfetto {
namespace {

// The first paragraph of a rule's page.
std::string demand_of(std::string_view rule) {
  const auto* page = analysis::find_rule_page(rule);
  return page == nullptr ? std::string() : std::string(page->meaning);
}

Annotations notes_of(const analysis::RuleVerdict& rule, std::string_view demand,
                     const analysis::SubjectVerdict& subject, const analysis::Evidence& evidence) {
  Annotations notes;
  notes.add(Note::rule, std::string_view(rule.id));
  notes.add(Note::subject, valid_utf8(subject.name_told_apart()));
  notes.add(Note::verdict, analysis::label(subject.verdict));
  notes.add(Note::demands, demand);
  notes.add(Note::found, valid_utf8(sentence(evidence.note)));
  const auto number = &evidence - subject.evidence.data() + 1;
  notes.add(Note::evidence, fmt::format("{} of {}", number, subject.evidence.size()));
  if (!evidence.event.empty()) notes.add(Note::event, valid_utf8(evidence.event));
  if (evidence.cpu) notes.add(Note::cpu, std::int64_t{*evidence.cpu});
  if (evidence.pid) notes.add(Note::pid, *evidence.pid);
  if (evidence.tid) notes.add(Note::tid, *evidence.tid);
  if (subject.suppression) {
    notes.add(Note::suppression, valid_utf8(words_of(*subject.suppression)));
  }
  return notes;
}

}  // namespace

std::uint64_t draw_violations(PacketBuffer& packets, Tracks& tracks,
                              const analysis::AnalysisResult& result, const FileBegin& begin) {
  const analysis::ReportRows rows(result.report);
  std::map<analysis::HostIndex, std::uint64_t> track_of;  // times are of a host's clock
  std::uint64_t count = 0;
  for (const auto& rule : result.verdicts.rules) {
    const auto demand = demand_of(rule.id);
    const auto name = fmt::format("{} {}", rule.id, rule.name);
    for (const auto& subject : rule.subjects) {
      if (subject.verdict != analysis::Verdict::fail) continue;
      const auto* process = subject.about.process ? rows.find(*subject.about.process) : nullptr;
      const auto host = process != nullptr ? process->host_index : analysis::HostIndex{};
      packets.set_machine(host);
      for (const auto& evidence : subject.evidence) {
        auto& track = track_of[host];
        if (track == 0) {
          track = tracks.new_uuid();
          packets.track(track, 0, "Enforcement");
        }
        const bool is_shown = evidence.time && evidence.time->ns > 0;
        const auto time = is_shown ? evidence.time->ns : begin.on(host);
        packets.named_instant(time, track, Category::enforcement, name,
                              notes_of(rule, demand, subject, evidence));
        ++count;
      }
    }
  }
  return count;
}

}  // namespace cie::viewer_export::perfetto
