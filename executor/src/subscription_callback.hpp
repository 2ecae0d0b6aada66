// A subscription, or the serving side of a service, as a callback.
#pragma once

#include <cie/executor/subscription.hpp>

#include "callback.hpp"
#include "clock.hpp"
#include "message_pool.hpp"
#include "reader.hpp"

#include <cstdint>
#include <memory>

namespace cie::executor {

class SubscriptionCallback final : public Callback {
 public:
  SubscriptionCallback(std::shared_ptr<GroupState> group, trace::CallbackInfo info,
                       std::unique_ptr<Reader> reader, MessageFunction function);
  ~SubscriptionCallback() override;

  bool execute_one() override;
  std::int64_t next_due() const noexcept override { return kNever; }
  void serve(ReadySink* sink) override;
  std::uint64_t queued() const noexcept override { return reader_->queued(); }
  dds::Entity new_read_condition() const override { return reader_->new_read_condition(); }
  const Reader& reader() const noexcept { return *reader_; }

 private:
  std::unique_ptr<Reader> reader_;
  MessageFunction function_;
  MessagePool messages_;
};

}  // namespace cie::executor
