// The answering side of a service.
#pragma once

#include <cie/executor/service.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include "dds/message_pool.hpp"
#include "dds/writer.hpp"
#include "service_clients.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

namespace cie::executor {

// Has the user's function fill in a response and sends it to who asked. One whose client cannot
// hear it yet waits until it can, and nothing else waits for it. Thread-safe.
class Replier {
 public:
  // So many responses may wait at most (0: any number); the oldest make room for others, as in a
  // queue. `clients` has begun.
  Replier(std::unique_ptr<Writer> writer, std::shared_ptr<ServiceClients> clients,
          std::uint32_t most_waiting, ErasedServiceFunction function);

  // `writer_gid` is the number of the client's writer. Throws what the user's function throws, and
  // dds::Error.
  void answer(const void* request, std::uint64_t writer_gid);
  // Sends those responses that waited and whose clients can hear them. Throws dds::Error.
  void send_waiting();

 private:
  struct Waiting {
    std::uint64_t writer_gid = 0;
    MessagePool::MessageHandle response;
  };

  std::unique_ptr<Writer> writer_;
  std::shared_ptr<ServiceClients> clients_;
  std::size_t most_waiting_;
  ErasedServiceFunction function_;
  MessagePool responses_;
  PriorityMutex mutex_;  // of what follows
  std::deque<Waiting> waiting_;
};

}  // namespace cie::executor
