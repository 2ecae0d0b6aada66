// A subscription, or the serving side of a service, as a callback.
#pragma once

#include <cie/executor/subscription.hpp>
#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/clock.hpp>

#include "dds/message_pool.hpp"
#include "dds/reader.hpp"
#include "scheduling_names.hpp"

#include <cstdint>
#include <memory>

namespace cie::executor {

class SubscriptionCallback final : public Callback {
 public:
  SubscriptionCallback(std::shared_ptr<GroupState> group, trace::CallbackInfo info,
                       std::unique_ptr<Reader> reader, MessageFunction function);
  ~SubscriptionCallback() override { end(); }

  std::int64_t next_due() const noexcept override { return kNever; }
  void serve(ReadySink* sink) override;
  std::uint64_t queued() const noexcept override { return reader_->queued(); }
  const Reader& reader() const noexcept { return *reader_; }

 private:
  bool run_one() override;
  void dispose() noexcept override;

  std::unique_ptr<Reader> reader_;
  MessageFunction function_;
  MessagePool messages_;
};

}  // namespace cie::executor
