// A rule's claims of one subject as its verdict.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "judgement.hpp"
#include "knowledge/claims.hpp"
#include "recorded_knowledge.hpp"

#include <utility>

namespace cie::analysis {

// `shows(witness)`: its events, as a list of Evidence.
template <typename Witness, typename Shows>
void weigh(const Claims<Witness>& claims, const RecordedKnowledge& known, const Shows& shows,
           Judgement& judgement) {
  judgement.check(claims.count());
  const bool is_proven = claims.verdict() == Verdict::fail;
  for (const auto& reason : claims.reasons())
    judgement.doubt(known.evidence_of(reason));
  for (const auto& witness : claims.witnesses()) {
    for (Evidence& item : shows(witness)) {
      if (is_proven) {
        judgement.fail(std::move(item));
      } else {
        judgement.doubt(std::move(item));
      }
    }
  }
}

}  // namespace cie::analysis
