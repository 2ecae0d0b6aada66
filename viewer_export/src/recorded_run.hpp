// A recording's instances and messages, kept on disk as far as they are many, and told again in
// order of time, each publication with those who took it. Exports to viewers draw from it.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/analysis/progress.hpp>

#include "external_sorter.hpp"
#include "name_table.hpp"

#include <compare>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace cie::viewer_export {

// A thread as viewers know it. Incarnations that followed one another under one tid share it.
struct ThreadKey {
  std::uint32_t host = 0;
  std::int64_t pid = 0;
  std::int64_t tid = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr): see time.hpp
  friend auto operator<=>(const ThreadKey&, const ThreadKey&) = default;
};

template <typename T>
ThreadKey thread_of(const T& told) {
  return {told.host, told.pid, told.tid};
}

struct RecordedInstance {
  analysis::Instance instance;  // without its views: the name stands below
  std::uint32_t name = 0;       // of the logical id, in RecordedRun::callbacks()
  std::uint64_t index = 0;      // in order of arrival
  // One whose publication is told before it, or, if its time is the same, right after it.
  bool takes_seen_message = false;
};

struct RecordedPublication {
  analysis::Publication publication;         // without its view
  std::uint32_t topic = 0;                   // in RecordedRun::topics()
  std::span<const std::uint64_t> receivers;  // index of each instance that took the message
};

// Memory is bounded but for one bit per instance and the names. Not thread-safe.
class RecordedRun {
 public:
  // `records_in_memory` of each kind; the rest goes to temporary files in `spill_directory`.
  RecordedRun(std::size_t records_in_memory, const std::filesystem::path& spill_directory)
      : instances_(records_in_memory, spill_directory),
        messages_(records_in_memory, spill_directory),
        publications_(records_in_memory, spill_directory) {}

  // False: its times make no sense (before zero, an end before its start); counted in skipped().
  // Throws WriteError when temporary files cannot be written.
  bool add(const analysis::Instance& instance);
  bool add(const analysis::Publication& publication);

  // Where replay() counts instances; borrowed, null: nowhere.
  void show_progress(analysis::Progress* progress) noexcept { progress_ = progress; }

  // Calls on_instance(RecordedInstance) at each start and on_publication(RecordedPublication) at
  // its time, in order of time; at one time instances first, the outer before the inner. Once.
  template <typename OnInstance, typename OnPublication>
  void replay(OnInstance on_instance, OnPublication on_publication);

  const NameTable& callbacks() const noexcept { return callbacks_; }
  const NameTable& topics() const noexcept { return topics_; }
  // The earliest of all times; empty if there is none.
  std::optional<std::int64_t> first_time() const noexcept;
  std::uint64_t skipped() const noexcept { return skipped_; }
  // After replay(): pairs of publication and receiver, and those left out because the message was
  // taken before it was published (clocks disagree).
  std::uint64_t deliveries() const noexcept { return deliveries_; }
  std::uint64_t backward_deliveries() const noexcept { return backward_deliveries_; }

 private:
  static constexpr std::uint64_t kNobody = std::numeric_limits<std::uint64_t>::max();

  struct ByStart {
    bool operator()(const RecordedInstance& a, const RecordedInstance& b) const;
  };
  // A message published, or taken by an instance.
  struct Message {
    std::uint64_t writer_gid = 0;
    std::int64_t source_timestamp = 0;
    bool is_take = false;
    std::int64_t time = 0;
    std::uint64_t instance = 0;           // take: index of the instance
    analysis::Publication publication{};  // else; its topic is a view and not kept
    std::uint32_t topic = 0;
  };
  // The publication of a message before those who took it.
  struct ByMessage {
    bool operator()(const Message& a, const Message& b) const;
  };
  // A publication, once for itself (receiver kNobody) and then for each receiver.
  struct Delivery {
    analysis::Publication publication;
    std::uint32_t topic = 0;
    bool is_delivered = false;
    std::uint64_t receiver = 0;
  };
  struct ByTime {
    bool operator()(const Delivery& a, const Delivery& b) const;
  };
  static bool is_same_message(const Message& a, const Message& b);

  void join_messages();
  // The next publication with all its receivers; false if there is none.
  bool take_publication(RecordedPublication& publication);

  NameTable callbacks_;
  NameTable topics_;
  ExternalSorter<RecordedInstance, ByStart> instances_;
  ExternalSorter<Message, ByMessage> messages_;
  ExternalSorter<Delivery, ByTime> publications_;
  std::vector<bool> takes_seen_message_;  // by index of the instance
  std::vector<std::uint64_t> receivers_;  // of the publication that is told
  analysis::Progress* progress_ = nullptr;
  std::uint64_t next_index_ = 0;
  std::int64_t first_time_ = std::numeric_limits<std::int64_t>::max();
  std::uint64_t skipped_ = 0;
  std::uint64_t deliveries_ = 0;
  std::uint64_t backward_deliveries_ = 0;
};

template <typename OnInstance, typename OnPublication>
void RecordedRun::replay(OnInstance on_instance, OnPublication on_publication) {
  if (progress_ != nullptr) progress_->total = instances_.size();
  join_messages();
  RecordedPublication publication;
  bool has_publication = take_publication(publication);
  const auto publish_until = [&](std::int64_t time) {
    while (has_publication && publication.publication.time.ns < time) {
      on_publication(publication);
      has_publication = take_publication(publication);
    }
  };
  instances_.drain([&](RecordedInstance record) {
    publish_until(record.instance.start.ns);
    record.takes_seen_message = takes_seen_message_[record.index];
    on_instance(record);
    if (progress_ != nullptr) progress_->add(1);
  });
  for (; has_publication; has_publication = take_publication(publication))
    on_publication(publication);
}

}  // namespace cie::viewer_export
