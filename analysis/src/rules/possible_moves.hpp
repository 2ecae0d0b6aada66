// Where lost instances may have run, if not where their callback ran otherwise.
#pragma once

#include "rule_context.hpp"

#include <map>
#include <vector>

namespace cie::analysis {

class PossibleMoves {
 public:
  explicit PossibleMoves(const RuleContext& context);
  // There is a thread that a lost instance of the callback may have moved to or from: one announced
  // for it, or one that is not another callback's and lived only before or after one of its own. By
  // what user space shows: that the kernel saw an exit makes no move likelier (law L6). The
  // callback ran somewhere.
  bool exist_of(const CallbackFacts& callback) const;

 private:
  struct Threads {
    std::vector<ThreadIndex> all;          // the last one to begin first
    std::vector<ThreadIndex> unannounced;  // likewise
    std::vector<ThreadIndex> read_back;    // unannounced: that was lost
    std::vector<ThreadIndex> ended;        // the first one to end first
  };

  const RuleContext& context_;
  std::map<ProcessIndex, Threads> shared_;  // those of a process that are not isolated
};

}  // namespace cie::analysis
