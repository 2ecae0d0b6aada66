// From facts to verdicts and report.
#include "model/addresses_in_turn.hpp"
#include "model/doubtful_ids.hpp"
#include "pipeline.hpp"
#include "report/evidence_places.hpp"
#include "report/report_builder.hpp"
#include "rules/rule.hpp"

#include <string>

namespace cie::analysis {

void Analyzer::Pipeline::name_events() {
  for (std::size_t i = 0; i < kEventNames.size(); ++i) {
    if (!kEventNames[i].empty() && by_class[i] > 0) {
      model.events.by_name[std::string(kEventNames[i])] = by_class[i];
    }
  }
}

AnalysisResult Analyzer::Pipeline::judge() {
  name_events();
  registry.doubt_told_again(recording.loss_times());
  doubt_numbered_ids(model);
  note_addresses_in_turn(model);
  AnalysisResult result;
  const RuleContext context(model, options);
  result.verdicts = verify(context);
  locate_evidence(model, result.verdicts);
  if (cut && model.begin && model.end) {
    result.verdicts.window = TimeWindow{.from = *model.begin, .to = *model.end};
  }
  result.report = build_report(context, result.verdicts);
  return result;
}

}  // namespace cie::analysis
