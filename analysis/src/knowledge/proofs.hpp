// What numbers, totals and tracers' accounts prove: that of some kinds nothing of a subject is hidden in a window.
#pragma once

#include "gap.hpp"
#include "windows.hpp"

#include <optional>
#include <unordered_map>

namespace cie::analysis {

class Proofs {
 public:
  // Of the subject: process, thread, callback, or some of them at once; host and CPU are not looked at. Nothing of these
  // kinds that belongs to it is hidden within the window, its ends included.
  void add(EventKinds kinds, const Scope& subject, TimeWindow window);

  // The first point in time in `window` at which such an event may be hidden.
  std::optional<Timestamp> first_unproven(EventKind kind, const Scope& scope,
                                          TimeWindow window) const noexcept;

 private:
  struct Subject {
    std::optional<ProcessIndex> process;
    std::optional<ThreadIndex> thread;
    std::optional<CallbackIndex> callback;
    EventKind kind{};
    friend bool operator==(const Subject&, const Subject&) = default;
  };
  struct Hash {
    std::size_t operator()(const Subject& subject) const noexcept;
  };

  std::unordered_map<Subject, Windows, Hash> windows_;
};

}  // namespace cie::analysis
