// Which clients of a service can hear its responses.
#pragma once

#include <cie/tracepoints/priority_mutex.hpp>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

namespace cie::executor {

// A client's request may arrive before its reply reader is discovered, and a response that is
// written then is lost. This remembers whose reader is connected, and looks again only for a client
// that it does not know to be, once for each time that a reader came or went. Thread-safe.
class ServiceClients {
 public:
  struct Client {
    std::uint64_t writer_gid = 0;  // of its requests
    bool can_hear = false;         // also who does not say which reader is its own
  };
  // Finds all whose requests come now. Allocates.
  using Look = std::function<std::vector<Client>()>;

  // `wake` has the service look after responses that wait for a reader. Before anybody asks.
  void begin(Look look, std::function<void()> wake) {
    look_ = std::move(look);
    wake_ = std::move(wake);
    has_begun_ = true;
  }

  // A reader came or went: on the thread of DDS that noticed, which may be before begin().
  void readers_changed() noexcept {
    is_stale_ = true;
    if (has_begun_) wake_();
  }

  // False while the reader is not connected; true if the client is gone.
  bool can_hear(std::uint64_t writer_gid) {
    const std::lock_guard lock{mutex_};
    const Client* client = find(writer_gid);
    if (client == nullptr || (!client->can_hear && is_stale_)) {
      is_stale_ = false;
      known_ = look_();
      std::ranges::sort(known_, {}, &Client::writer_gid);
      client = find(writer_gid);
    }
    return client == nullptr || client->can_hear;
  }

 private:
  const Client* find(std::uint64_t writer_gid) const {
    const auto found = std::ranges::lower_bound(known_, writer_gid, {}, &Client::writer_gid);
    return found != known_.end() && found->writer_gid == writer_gid ? &*found : nullptr;
  }

  Look look_;
  std::function<void()> wake_;
  std::atomic<bool> has_begun_{false};
  std::atomic<bool> is_stale_{true};
  PriorityMutex mutex_;  // of what follows
  std::vector<Client> known_;
};

}  // namespace cie::executor
