// The answering side of a service.
#pragma once

#include <cie/executor/service.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include "dds/message_pool.hpp"
#include "dds/writer.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace cie::executor {

// Has the user's function fill in a response and sends it to who asked. Thread-safe.
class Replier {
 public:
  // `request_reader`: what the requests come from.
  Replier(std::unique_ptr<Writer> writer, dds_entity_t request_reader,
          ErasedServiceFunction function);

  // `writer_gid` is the number of the client's writer. Throws what the user's function throws, and
  // dds::Error.
  void answer(const void* request, std::uint64_t writer_gid);

 private:
  // A client's request may arrive before its reply reader is discovered, and what is written then
  // is lost. So the first response to each client waits for that reader, for a bounded time. Which
  // reader that is tells the identity that a client's reader and writer share.
  void wait_for_reader(std::uint64_t writer_gid);
  bool is_known(std::uint64_t writer_gid);

  std::unique_ptr<Writer> writer_;
  dds_entity_t request_reader_;
  ErasedServiceFunction function_;
  MessagePool responses_;
  PriorityMutex mutex_;                    // of what follows
  std::array<std::uint64_t, 64> known_{};  // writers of the latest clients that need no waiting
  std::size_t next_known_ = 0;
};

}  // namespace cie::executor
