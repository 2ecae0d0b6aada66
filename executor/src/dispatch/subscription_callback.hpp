// A subscription as a callback.
#pragma once

#include <cie/executor/subscription.hpp>

#include "reader_callback.hpp"

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace cie::executor {

class SubscriptionCallback final : public ReaderCallback {
 public:
  SubscriptionCallback(std::shared_ptr<GroupState> group, trace::CallbackInfo info,
                       std::unique_ptr<Reader> reader, MessageFunction function)
      : ReaderCallback(std::move(group), std::move(info), std::move(reader)),
        function_(std::move(function)) {}
  ~SubscriptionCallback() override { end(); }

  // The callbacks of its events, which end with it. Set before it is served.
  void set_events(std::vector<std::shared_ptr<Callback>> events) { events_ = std::move(events); }
  const std::vector<std::shared_ptr<Callback>>& events() const noexcept { return events_; }

 private:
  bool run_one() override;
  void dispose() noexcept override;

  MessageFunction function_;
  std::vector<std::shared_ptr<Callback>> events_;
};

}  // namespace cie::executor
