#include "subscription_callback.hpp"

#include <utility>

namespace cie::executor {

SubscriptionCallback::SubscriptionCallback(std::shared_ptr<GroupState> group,
                                           trace::CallbackInfo info, std::unique_ptr<Reader> reader,
                                           MessageFunction function)
    : Callback(std::move(group), std::move(info)),
      reader_(std::move(reader)),
      function_(std::move(function)),
      messages_(reader_->layout()) {
  reader_->delivery().set_trace(&trace());
}

void SubscriptionCallback::dispose() noexcept {
  reader_->delivery().set_trace(nullptr);
  trace().overwritten(reader_->close());
  function_ = nullptr;
}

void SubscriptionCallback::serve(ReadySink* sink) {
  reader_->delivery().set_target(sink, this);
  if (sink != nullptr) sink->on_ready(*this);  // for what arrived before
}

bool SubscriptionCallback::run_one() {
  MessagePool::Loan message{messages_};
  MessageInfo info;
  if (!reader_->take(message, info)) {
    // An empty queue tells exactly what it lost; the arrivals before it may have been too early to.
    trace().overwritten(reader_->delivery().count().overwritten());
    return false;
  }
  const Instance instance{*this,
                          {.kind = ReleaseKind::data,
                           .release_ns = info.arrival_ns,
                           .source_timestamp_realtime_ns = info.source_timestamp_realtime_ns,
                           .writer_gid = info.writer_gid}};
  function_(message.handle(), info);
  return true;
}

const std::string& logical_id_of(const SubscriptionCallback& callback) noexcept {
  return callback.logical_id();
}
CallbackId id_of(const SubscriptionCallback& callback) noexcept { return callback.id(); }
std::uint32_t matched_writers(const SubscriptionCallback& callback) {
  return callback.reader().matched();
}

}  // namespace cie::executor
