// The middleware of the double: topics within a process. One thread delivers, as DDS's does.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <rmw/types.h>

namespace rmw_double {

using Told = std::function<void(std::size_t)>;

// Who is told that something came, and how much came while nobody was.
class Notice {
 public:
  // Told at once of what was missed, at most `bound`.
  void set(Told told, std::optional<std::size_t> bound = {});
  // It is not being told when this returns.
  void clear();
  // The same, for good.
  void end();
  void raise();
  bool is_set();

 private:
  std::mutex mutex_;  // held while it is told, as by the middleware
  Told told_;
  std::size_t missed_ = 0;
  bool has_ended_ = false;
};

struct Sample {
  std::shared_ptr<const void> data{};
  rmw_message_info_t info{};
  rmw_request_id_t request{};
};

// Something that happened to an end of a topic: its QoS do not go with another's, or a message was lost.
class Event {
 public:
  struct Count {
    int total = 0;
    int change = 0;  // since it was taken the last time
  };
  void raise(int count = 1);
  std::optional<Count> take();
  Notice notice;

 private:
  std::mutex mutex_;  // of what follows
  Count count_;
};

// The queue of a subscription, service or client; a full one loses its oldest.
class Reader {
 public:
  // `bounds_missed`: what was missed is told of up to the depth, as to subscriptions.
  explicit Reader(const rmw_qos_profile_t& qos, bool bounds_missed = false)
      : qos_(qos), bounds_missed_(bounds_missed) {}
  const rmw_qos_profile_t& qos() const { return qos_; }
  std::size_t bound() const {
    return qos_.history == rmw_qos_history_policy_t::KeepLast ? qos_.depth : 0;
  }
  void store(Sample sample);
  std::optional<Sample> take();
  // Who is called when something came; null ends it.
  void set_on_new(void (*callback)(const void* user_data, std::size_t count),
                  const void* user_data);
  Notice notice;
  Event lost;

 private:
  const rmw_qos_profile_t qos_;
  const bool bounds_missed_;
  std::mutex mutex_;  // of what follows
  std::deque<Sample> samples_;
};

// What rcl has of a reader: with it, the middleware's goes, and calls nobody any more.
class OwnedReader {
 public:
  explicit OwnedReader(std::shared_ptr<Reader> read) : reader(std::move(read)) {}
  OwnedReader(const OwnedReader&) = delete;
  OwnedReader& operator=(const OwnedReader&) = delete;
  ~OwnedReader() { reader->notice.end(); }

  const std::shared_ptr<Reader> reader;
};

// An end of a topic.
struct End {
  std::weak_ptr<void> owner{};
  std::weak_ptr<Reader> reader{};  // none: it writes
  rmw_qos_profile_t qos{};
  std::weak_ptr<Event> incompatible{};
};

class Bus {
 public:
  static Bus& get();
  std::uint64_t new_gid();
  void join(const std::string& topic, End end);
  // A writer's end. Readers whose last one that was are told, as of a message.
  void leave(const std::string& topic, const std::shared_ptr<void>& owner);
  std::size_t readers(const std::string& topic, const rmw_qos_profile_t& writer);
  void write(const std::string& topic, const rmw_qos_profile_t& writer, Sample sample);
  // On the thread that delivers, in order.
  void deliver(std::function<void()> job);

  // Publishers that also send through the process.
  void add_process_publisher(std::uint64_t gid);
  void remove_process_publisher(std::uint64_t gid);
  bool is_process_publisher(std::uint64_t gid);
  void join_process(const std::string& topic, std::weak_ptr<void> subscription);
  std::vector<std::shared_ptr<void>> process_subscriptions(const std::string& topic);

 private:
  void run();
  std::vector<End> other_ends(const std::string& topic, bool readers);

  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;
  std::map<std::string, std::vector<End>> ends_;
  std::map<std::string, std::vector<std::weak_ptr<void>>> in_process_;
  std::set<std::uint64_t> process_publishers_;
  std::uint64_t next_gid_ = 1;
};

// Whether subscriptions take messages as loans of the middleware's, as with shared memory.
void set_loans(bool are_loaned);
bool are_loaned();

}  // namespace rmw_double
