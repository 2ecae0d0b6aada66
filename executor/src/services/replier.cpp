#include "replier.hpp"

#include <cie/scheduling/clock.hpp>

#include "scheduling_names.hpp"
#include "service_endpoint.hpp"
#include "service_type.hpp"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

namespace cie::executor {
namespace {

// Discovery between two processes takes milliseconds.
constexpr std::int64_t kPatienceNs = 500'000'000;

// Empties a message, so that the next response begins as the first one did.
class Emptied {
 public:
  Emptied(void* message, const MessageLayout& layout) : message_(message), layout_(layout) {}
  Emptied(const Emptied&) = delete;
  Emptied& operator=(const Emptied&) = delete;
  ~Emptied() { layout_.clear(message_); }

 private:
  void* message_;
  const MessageLayout& layout_;
};

}  // namespace

Replier::Replier(std::unique_ptr<Writer> writer, dds_entity_t request_reader,
                 ErasedServiceFunction function)
    : writer_(std::move(writer)),
      request_reader_(request_reader),
      function_(std::move(function)),
      responses_(writer_->layout()) {}

void Replier::answer(const void* request, std::uint64_t writer_gid) {
  MessagePool::Loan loan{responses_};
  void* const response = loan.memory();
  const Emptied emptied{response, *writer_->layout()};
  const CallHeader header = header_of(request);
  function_(payload_of(request), payload_of(response));
  set_header(response, header);
  wait_for_reader(writer_gid);
  writer_->publish(response);
}

bool Replier::is_known(std::uint64_t writer_gid) {
  const std::lock_guard lock{mutex_};
  return std::ranges::find(known_, writer_gid) != known_.end();
}

void Replier::wait_for_reader(std::uint64_t writer_gid) {
  if (is_known(writer_gid)) return;
  if (const auto client = client_of(request_reader_, writer_gid)) {
    const std::int64_t end = monotonic_now() + kPatienceNs;
    while (!has_client(writer_->entity(), *client) && monotonic_now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    }
  }
  const std::lock_guard lock{mutex_};
  known_.at(next_known_) = writer_gid;
  next_known_ = (next_known_ + 1) % known_.size();
}

}  // namespace cie::executor
