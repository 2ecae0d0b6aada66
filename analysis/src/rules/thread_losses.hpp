// Which threads may have run instances that were lost.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"
#include "proof.hpp"

#include <map>
#include <optional>

namespace cie::analysis {

// A lost instance of a callback ran where the callback ran otherwise or where it was announced to
// run; if that is in a pool, on any thread of the pool.
class ThreadLosses {
 public:
  ThreadLosses(const Model& model, const Proof& proof);
  std::optional<Evidence> on(ThreadIndex thread) const;

 private:
  const Model& model_;
  std::map<ThreadIndex, Evidence> on_threads_;
  std::map<ProcessIndex, Evidence> in_pools_;
};

}  // namespace cie::analysis
