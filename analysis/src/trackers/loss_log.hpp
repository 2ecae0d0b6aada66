// What tracers lost, and what cannot be read of what they wrote: the model's losses, and when they were.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/time.hpp>

#include "kernel_coverage.hpp"
#include "model/facts.hpp"
#include "model/loss_times.hpp"
#include "registry.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>

namespace cie::analysis {

// Bounded: of more losses than there is room for some of one kind and place are one with a count.
class LossLog {
 public:
  // `asked`: losses elsewhere are no losses of it. `is_live`: see AnalysisOptions.
  LossLog(Model& model, const Registry& registry, const KernelCoverage& coverage,
          std::optional<TimeWindow> asked, bool is_live)
      : model_(model), registry_(registry), coverage_(coverage), asked_(asked), is_live_(is_live) {}

  void apply(const EventHead& head, const Discarded& event);
  void apply(const EventHead& head, const DamagedPacket& event);
  void apply(const EventHead& head, const SessionGap& event);
  void apply(const EventHead& head, const TimeRegression& event);
  void add(Loss loss);
  // No events are known to be missing, but there may be some.
  void add_time(HostIndex host, Timestamp begin, Timestamp end) { times_.add(host, begin, end); }
  // Of the gaps between sessions, those that a process lived through, as far as is known.
  void add_host_gaps();
  // Again, as more is read, with a later end.
  void add_host_gap(HostIndex host, Timestamp begin, Timestamp end, std::string note);
  // Of the streams of applications that are evidence.
  const LossTimes& times() const noexcept { return times_; }

 private:
  void note_user_loss(const EventHead& head, Timestamp begin, Timestamp end);
  // It was over when the window that was asked for began.
  void note_before(Loss loss);
  // Adds it to the list, or where that is full to the loss of its kind and place that stands for the rest. Its
  // place there.
  std::size_t list(const Loss& loss);

  Model& model_;
  const Registry& registry_;
  const KernelCoverage& coverage_;
  std::optional<TimeWindow> asked_;
  bool is_live_;
  LossTimes times_;
  std::size_t kernel_losses_ = 0;  // in the model
  // Of each kind and place, whether counted or not, the one in the model that stands for the rest.
  using Kind = std::tuple<LossKind, Domain, HostIndex, std::optional<std::int32_t>, bool>;
  std::map<Kind, std::size_t> rest_;
};

}  // namespace cie::analysis
