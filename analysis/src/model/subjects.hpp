// Names of subjects as verdicts print them, and the orders in which things are printed.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "facts.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace cie::analysis {

// A subject with its name: "callback LOGICAL_ID" and the like.
struct NamedSubject {
  Subject about{};
  std::string name{};
  std::string ordinal{};
  std::string place{};

  // The trace as a whole.
  static NamedSubject trace() { return {.name = "trace"}; }
  // One that the spec or the kernel names, and that is no row of the report.
  static NamedSubject without_row(SubjectKind kind, const std::string& name);
};

// Their places are " (pid N)" when the trace holds several processes, " (pid N, program M)" when they
// had one pid, and " (pid N on HOST)" when they are of several hosts. Before that stands
// " (lifetime N)" of later threads of a process that had one tid and later callbacks that had one
// logical id, and " (publisher N)" of later publishers of one topic, in the order in which they were
// first seen (callbacks: created).
class Subjects {
 public:
  // `callbacks`: all, as callbacks_in_order() has them.
  Subjects(const Model& model, std::span<const CallbackIndex> callbacks);

  // Of several processes that had one pid, how many had it up to this one. 0: it alone had it.
  std::uint32_t program_of(ProcessIndex index) const { return programs_[at(index)]; }

  // From 1: of the callbacks of its process with its logical id, how many up to this one.
  std::uint32_t lifetime_of(CallbackIndex index) const { return callbacks_[at(index)]; }

  NamedSubject process(ProcessIndex index) const;  // "process PID"
  NamedSubject callback(CallbackIndex index) const;
  NamedSubject thread(ThreadIndex index) const;
  NamedSubject group(GroupIndex index) const;
  NamedSubject group(ProcessIndex process, GroupId id) const;  // one that was never announced
  NamedSubject group_of(ThreadIndex index) const;              // one that nothing tells
  NamedSubject topic(PublisherIndex index) const;
  NamedSubject chain(ChainIndex index) const;  // of no process when it spans several

 private:
  NamedSubject named(Subject about, const std::string& name, std::string ordinal = {}) const;
  std::string lifetime_of(ThreadIndex index) const;
  std::string ordinal_of(PublisherIndex index) const;
  std::string place_of(ProcessIndex index) const;

  const Model& model_;
  bool has_several_ = false;  // processes
  bool has_several_hosts_ = false;
  std::vector<std::uint32_t> programs_;   // by process
  std::vector<std::uint32_t> callbacks_;  // by callback, as lifetime_of() has it
  // From 1: of its process's with its tid, or with its topic. Counted when the first one is asked for:
  // a report asks for none.
  mutable std::vector<std::uint32_t> lifetimes_;   // by thread
  mutable std::vector<std::uint32_t> publishers_;  // by publisher
};

// Callbacks by host, pid, process and id: creation order within a process.
std::vector<CallbackIndex> callbacks_in_order(const Model& model);

}  // namespace cie::analysis
