#include "client_callback.hpp"

#include "services/service_endpoint.hpp"
#include "services/service_type.hpp"

#include <cstddef>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace cie::executor {

ClientCallback::ClientCallback(std::shared_ptr<GroupState> group, const trace::CallbackInfo& info,
                               ClientEnd end, std::int64_t timeout_ns)
    : ReaderCallback(std::move(group), info, std::move(end.responses)),
      service_(info.source),
      writer_(std::move(end.requests)),
      guid_(end.guid),
      timeout_ns_(timeout_ns) {}

void ClientCallback::dispose() noexcept {
  ReaderCallback::dispose();
  std::map<std::int64_t, Request> dropped;  // with what users gave, so without the lock
  const std::lock_guard lock{mutex_};
  dropped.swap(requests_);
  update_next_due();
}

void ClientCallback::update_next_due() {
  next_due_ns_.store(requests_.empty() ? kNever : requests_.begin()->second.deadline_ns,
                     std::memory_order_relaxed);
}

void ClientCallback::send(const void* request, Completion completion) {
  std::int64_t seq = 0;
  bool is_first = false;
  {
    const std::lock_guard lock{mutex_};
    seq = ++last_seq_;
    const std::int64_t deadline =
        timeout_ns_ > 0 ? scheduling::later(monotonic_now(), timeout_ns_) : kNever;
    requests_.emplace(seq, Request{std::move(completion), deadline});
    is_first = requests_.size() == 1;
    update_next_due();
  }
  try {
    // Its contents stay the user's: DDS copies them out.
    std::vector<std::byte> message(writer_->layout()->size());
    set_header(message.data(), {.guid = guid_, .seq = seq});
    std::memcpy(payload_of(message.data()), request, message.size() - sizeof(CallHeader));
    if (!writer_->publish(message.data()))
      throw dds::Error{"sending a request", service_, DDS_RETCODE_TIMEOUT};
  } catch (...) {
    remove(seq);
    throw;
  }
  // Whoever serves it may sleep without end.
  if (is_first && timeout_ns_ > 0) reader().delivery().wake();
}

std::optional<ClientCallback::Request> ClientCallback::remove(std::int64_t seq) {
  const std::lock_guard lock{mutex_};
  auto node = requests_.extract(seq);
  update_next_due();
  if (node.empty()) return std::nullopt;
  return std::move(node.mapped());
}

std::optional<ClientCallback::Request> ClientCallback::remove_overdue() {
  if (next_due_ns_.load(std::memory_order_relaxed) > monotonic_now()) return std::nullopt;
  const std::lock_guard lock{mutex_};
  const auto first = requests_.begin();
  if (first == requests_.end() || first->second.deadline_ns > monotonic_now()) return std::nullopt;
  Request request = std::move(first->second);
  requests_.erase(first);
  update_next_due();
  return request;
}

// What has arrived comes before what is overdue: a late thread makes no timeout of a response that
// is there.
bool ClientCallback::run_one() {
  const bool has_run = run_next([this](const MessagePool::Loan& response, const MessageInfo& info) {
    const auto request = remove(header_of(response.get()).seq);
    if (!request) return false;
    const Instance instance{*this, release_by(info)};
    request->completion({response.handle(), payload_of(response.get())});
    return true;
  });
  if (has_run) return true;
  const auto request = may_begin() ? remove_overdue() : std::nullopt;
  if (!request) return false;
  const Instance instance{*this, {.kind = ReleaseKind::timer, .release_ns = request->deadline_ns}};
  request->completion(nullptr);
  return true;
}

bool ClientCallback::is_ready() const { return writer_->matched() > 0 && reader().matched() > 0; }

std::size_t ClientCallback::pending() const {
  const std::lock_guard lock{mutex_};
  return requests_.size();
}

void send_request(ClientCallback& client, const void* request, Completion completion) {
  client.send(request, std::move(completion));
}
const std::string& service_of(const ClientCallback& client) noexcept { return client.service(); }
bool is_ready(const ClientCallback& client) { return client.is_ready(); }
std::size_t pending_requests(const ClientCallback& client) { return client.pending(); }

bool wait_until_ready(const ClientCallback& client, std::chrono::nanoseconds timeout) {
  const auto end = scheduling::later(monotonic_now(), timeout.count());
  while (!client.is_ready()) {
    if (monotonic_now() >= end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  return true;
}

}  // namespace cie::executor
