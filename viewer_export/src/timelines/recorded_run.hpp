// A recording's instances and messages, kept on disk as far as they are many, and told again in
// order of time, each publication with those who took it. Exports to viewers draw from it.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/analysis/progress.hpp>

#include "common_clock.hpp"
#include "message_window.hpp"
#include "output/external_sorter.hpp"
#include "output/name_table.hpp"
#include "recorded_items.hpp"
#include "thread_table.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

namespace cie::viewer_export {

// Memory is bounded but for one bit per instance and the names. Not thread-safe.
class RecordedRun {
 public:
  // `records_in_memory` of each kind; the rest goes to temporary files in `spill_directory`.
  RecordedRun(std::size_t records_in_memory, const std::filesystem::path& spill_directory);

  // False: its times make no sense (before zero, an end before its start); counted in skipped().
  // Throws WriteError when temporary files cannot be written.
  bool add(const analysis::Instance& instance);
  bool add(const analysis::Publication& publication);

  // Where replay() counts instances; borrowed, null: nowhere.
  void show_progress(analysis::Progress* progress) noexcept { progress_ = progress; }

  // Calls on_instance(RecordedInstance) at each start and on_publication(RecordedPublication) at
  // its time, in order of time by `clock`; at one time instances first, the outer before the inner.
  // What it tells has the times of each host's own clock, and releases as `report` has them. Once.
  template <typename OnInstance, typename OnPublication>
  void replay(const analysis::Report& report, const CommonClock& clock, OnInstance on_instance,
              OnPublication on_publication);

  const NameTable& callbacks() const noexcept { return callbacks_; }
  const NameTable& topics() const noexcept { return topics_; }
  const ThreadTable& threads() const noexcept { return threads_; }
  // The earliest of all times by `clock`; empty if there is none.
  std::optional<std::int64_t> first_time(const CommonClock& clock) const;
  std::uint64_t skipped() const noexcept { return skipped_; }
  // After replay(): pairs of publication and receiver, and those left out because the message was
  // taken before it was published (clocks disagree).
  std::uint64_t deliveries() const noexcept { return deliveries_; }
  std::uint64_t backward_deliveries() const noexcept { return backward_deliveries_; }

 private:
  // What to add to times of each thread, by number, for those of one clock. Empty: nothing.
  using Shifts = std::vector<analysis::Duration>;

  // A publication to those who look for it.
  struct Published {
    std::int64_t time = 0;
    std::uint64_t index = 0;
    std::uint32_t thread = 0;
    std::uint32_t receivers = 0;
  };
  // A message published, or taken by an instance.
  struct Message {
    MessageKey key;
    bool is_take = false;
    std::uint32_t thread = 0;
    std::int64_t time = 0;
    std::uint64_t index = 0;  // of the publication or the instance
  };
  // A publication with one who took it.
  struct Delivery {
    std::int64_t time = 0;          // of the publication
    std::uint64_t publication = 0;  // its index
    std::uint64_t receiver = 0;
    std::uint32_t thread = 0;  // of the publication
  };
  // One between hosts, which only the clocks of both show to be possible.
  struct FarDelivery {
    Delivery delivery;
    std::int64_t taken = 0;
    std::uint32_t thread = 0;  // of the receiver
  };
  // The orders below are by time as `shifts` say; null: as it is.
  struct ByStart {
    const Shifts* shifts = nullptr;
    bool operator()(const KeptInstance& a, const KeptInstance& b) const;
  };
  struct ByTime {
    const Shifts* shifts = nullptr;
    bool operator()(const KeptPublication& a, const KeptPublication& b) const {
      return std::tuple(shifted(shifts, a), a.index) < std::tuple(shifted(shifts, b), b.index);
    }
  };
  struct ByPublication {
    const Shifts* shifts = nullptr;
    bool operator()(const Delivery& a, const Delivery& b) const {
      return std::tuple(shifted(shifts, a), a.publication, a.receiver) <
             std::tuple(shifted(shifts, b), b.publication, b.receiver);
    }
  };
  struct ByReceiver {
    bool operator()(const FarDelivery& a, const FarDelivery& b) const {
      return a.delivery.receiver < b.delivery.receiver;
    }
  };
  // The publication of a message before those who took it.
  struct ByMessage {
    bool operator()(const Message& a, const Message& b) const;
  };

  using Instances = ExternalSorter<KeptInstance, ByStart>;
  using Publications = ExternalSorter<KeptPublication, ByTime>;
  using Deliveries = ExternalSorter<Delivery, ByPublication>;

  static std::int64_t shifted(const Shifts* shifts, std::uint32_t thread, std::int64_t time) {
    return shifts == nullptr ? time : (analysis::Timestamp{time} + (*shifts)[thread]).ns;
  }
  template <typename Timed>
  static std::int64_t shifted(const Shifts* shifts, const Timed& timed) {
    return shifted(shifts, timed.thread, timed.time);
  }
  std::int64_t shifted(std::uint32_t thread, std::int64_t time) const {
    return shifted(shifts_.empty() ? nullptr : &shifts_, thread, time);
  }

  void note_time(std::uint32_t thread, std::int64_t time);
  // An instance on `thread` took the message.
  void deliver(Published& publication, std::int64_t time, std::uint64_t receiver,
               std::uint32_t thread);
  void keep(const Delivery& delivery);
  // Puts everything in order of one clock and joins the messages that are left.
  void prepare(const CommonClock& clock);
  // The same records in the order of shifts_.
  template <typename Sorter, typename Less>
  void sort_again(std::unique_ptr<Sorter>& sorter, Less less);
  // Finds the publications of the messages whose takers did not find them.
  void join_the_rest();
  // The next publication with all its receivers; false if there is none.
  bool take_publication(RecordedPublication& publication);

  std::size_t records_in_memory_;
  std::filesystem::path spill_directory_;
  NameTable callbacks_;
  NameTable topics_;
  ThreadTable threads_;
  std::unique_ptr<Instances> instances_;
  std::unique_ptr<Publications> publications_;
  std::unique_ptr<Deliveries> deliveries_of_;
  ExternalSorter<FarDelivery, ByReceiver> far_deliveries_;
  MessageWindow<Published> window_;
  // Takes whose publication the window does not have: it was long ago, or is told later, or never.
  ExternalSorter<Message, ByMessage> lone_takes_;
  std::vector<bool> takes_seen_message_;  // by index of the instance
  std::vector<std::uint64_t> receivers_;  // of the publication that is told
  analysis::Progress* progress_ = nullptr;
  std::vector<std::int64_t> first_times_;  // by thread
  Shifts shifts_;
  std::uint64_t published_ = 0;
  std::uint64_t skipped_ = 0;
  std::uint64_t deliveries_ = 0;
  std::uint64_t backward_deliveries_ = 0;
};

template <typename OnInstance, typename OnPublication>
void RecordedRun::replay(const analysis::Report& report, const CommonClock& clock,
                         OnInstance on_instance, OnPublication on_publication) {
  const TakenBackReleases taken_back(report);
  if (progress_ != nullptr) progress_->total = instances_->size();
  prepare(clock);
  RecordedPublication publication;
  bool has_publication = take_publication(publication);
  const auto publish_until = [&](std::int64_t time) {
    while (has_publication && shifted(publication.thread, publication.publication.time.ns) < time) {
      on_publication(publication);
      has_publication = take_publication(publication);
    }
  };
  instances_->drain([&](const KeptInstance& kept) {
    publish_until(shifted(kept.thread, kept.start));
    auto record = restored(taken_back.corrected(kept), threads_);
    record.takes_seen_message = takes_seen_message_[record.index];
    on_instance(record);
    if (progress_ != nullptr) progress_->add(1);
  });
  for (; has_publication; has_publication = take_publication(publication))
    on_publication(publication);
}

}  // namespace cie::viewer_export
