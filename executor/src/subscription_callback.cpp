#include "subscription_callback.hpp"

#include <utility>

namespace cie::executor {

SubscriptionCallback::SubscriptionCallback(std::shared_ptr<GroupState> group,
                                           trace::CallbackInfo info, std::unique_ptr<Reader> reader,
                                           const dds_topic_descriptor& type,
                                           MessageFunction function)
    : Callback(std::move(group), std::move(info)),
      reader_(std::move(reader)),
      type_(type),
      function_(std::move(function)),
      spare_(new_message()) {
  reader_->delivery().set_trace(&trace());
}

SubscriptionCallback::~SubscriptionCallback() {
  reader_->delivery().set_target(nullptr, nullptr);
  reader_->delivery().set_trace(nullptr);
  trace().overwritten(reader_->close());
}

void SubscriptionCallback::serve(ReadySink* sink) {
  reader_->delivery().set_target(sink, this);
  if (sink != nullptr) sink->on_ready(*this);  // for what arrived before
}

SubscriptionCallback::Message SubscriptionCallback::new_message() const {
  return Message{allocate_message(type_),
                 [&type = type_](void* message) { free_message(message, type); }};
}

SubscriptionCallback::Message SubscriptionCallback::borrow_message() {
  auto expected = Spare::there;
  if (!spare_state_.compare_exchange_strong(expected, Spare::moving, std::memory_order_acquire)) {
    return new_message();
  }
  Message message = std::move(spare_);
  spare_state_.store(Spare::lent, std::memory_order_release);
  return message;
}

void SubscriptionCallback::give_back(Message message) noexcept {
  if (message.use_count() != 1) return;  // the user kept it
  // Nobody can come by another reference now. Taking and dropping one makes the reads of whoever
  // dropped the last one precede the reuse (use_count() alone orders nothing).
  Message{message}.reset();
  auto expected = Spare::lent;
  if (!spare_state_.compare_exchange_strong(expected, Spare::moving, std::memory_order_acquire)) {
    return;
  }
  spare_ = std::move(message);
  spare_state_.store(Spare::there, std::memory_order_release);
}

bool SubscriptionCallback::execute_one() {
  Lent lent{*this};
  MessageInfo info;
  if (!reader_->take(lent.message.get(), info)) {
    // An empty queue tells exactly what it lost; the arrivals before it may have been too early to.
    trace().overwritten(reader_->delivery().count().overwritten());
    return false;
  }
  const Instance instance{*this,
                          {.kind = ReleaseKind::data,
                           .release_ns = info.arrival_ns,
                           .source_timestamp_realtime_ns = info.source_timestamp_realtime_ns,
                           .writer_gid = info.writer_gid}};
  function_(lent.message, info);
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
