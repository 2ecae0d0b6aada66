#include "replier.hpp"

#include "scheduling_names.hpp"
#include "service_endpoint.hpp"
#include "service_type.hpp"

#include <limits>
#include <mutex>
#include <utility>

namespace cie::executor {

Replier::Replier(std::unique_ptr<Writer> writer, std::shared_ptr<ServiceClients> clients,
                 std::uint32_t most_waiting, ErasedServiceFunction function)
    : writer_(std::move(writer)),
      clients_(std::move(clients)),
      most_waiting_(most_waiting > 0 ? most_waiting : std::numeric_limits<std::size_t>::max()),
      function_(std::move(function)),
      responses_(writer_->layout()) {}

void Replier::answer(const void* request, std::uint64_t writer_gid) {
  MessagePool::Loan loan{responses_};
  void* const response = loan.memory();
  writer_->layout()->clear(response);  // what the last one left
  const CallHeader header = header_of(request);
  function_(payload_of(request), payload_of(response));
  set_header(response, header);
  {
    // Under the lock: who is woken by a reader finds what waits for it.
    const std::lock_guard lock{mutex_};
    if (!clients_->can_hear(writer_gid)) {
      if (waiting_.size() == most_waiting_) waiting_.pop_front();
      waiting_.push_back({writer_gid, loan.handle()});
      return;
    }
  }
  writer_->publish(response);
}

void Replier::send_waiting() {
  const std::lock_guard lock{mutex_};
  for (auto each = waiting_.begin(); each != waiting_.end();) {
    if (!clients_->can_hear(each->writer_gid)) {
      ++each;
      continue;
    }
    const auto response = std::move(each->response);
    each = waiting_.erase(each);
    writer_->publish(response.get());
  }
}

}  // namespace cie::executor
