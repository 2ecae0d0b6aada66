// The answering side of a service.
#pragma once

#include <cie/executor/service.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include "message_pool.hpp"
#include "service_endpoint.hpp"
#include "writer.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace cie::executor {

// Has the user's function fill in a response and sends it to who asked. Thread-safe.
class Replier {
 public:
  Replier(std::unique_ptr<Writer> writer, const dds_topic_descriptor& response_type,
          ErasedServiceFunction function);

  // Throws what the user's function throws, and dds::Error.
  void answer(const void* request);

 private:
  // A client's request may arrive before its reply reader is discovered, and what is written then
  // is lost. So the first response to each client waits for that reader, for a bounded time.
  void wait_for_reader(std::uint64_t guid);
  bool is_known(std::uint64_t guid);

  std::unique_ptr<Writer> writer_;
  const dds_topic_descriptor& type_;
  ErasedServiceFunction function_;
  MessagePool responses_;
  PriorityMutex mutex_;                    // of what follows
  std::array<std::uint64_t, 64> known_{};  // the latest clients that need no waiting any more
  std::size_t next_known_ = 0;
};

}  // namespace cie::executor
