// A callback that messages of a reader release.
#pragma once

#include <cie/executor/message.hpp>
#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/clock.hpp>

#include "dds/message_pool.hpp"
#include "dds/reader.hpp"
#include "kept_messages.hpp"
#include "scheduling_names.hpp"

#include <cstdint>
#include <memory>
#include <utility>

namespace cie::executor {

class ReaderCallback : public Callback {
 public:
  void serve(ReadySink* sink) final {
    reader_->delivery().set_target(sink, this);
    if (sink != nullptr) sink->on_ready(*this);  // for what arrived before
  }
  std::uint64_t queued() const noexcept final { return reader_->queued() + kept_.size(); }
  std::int64_t next_due() const noexcept override { return kept_.size() > 0 ? kAtOnce : kNever; }
  const Reader& reader() const noexcept { return *reader_; }

 protected:
  ReaderCallback(std::shared_ptr<GroupState> group, trace::CallbackInfo info,
                 std::unique_ptr<Reader> reader)
      : Callback(std::move(group), std::move(info)),
        reader_(std::move(reader)),
        messages_(reader_->layout()) {
    reader_->delivery().set_trace(&trace());
  }

  // Takes messages until `run` ran an instance for one, and says whether it did.
  template <typename Run>
  bool run_next(Run run) {
    MessagePool::Loan message{messages_};
    MessageInfo info;
    while (kept_.take(message, info) || reader_->take(message, info)) {
      if (!may_begin()) {
        kept_.add(message, info);
        return false;
      }
      if (run(message, info)) return true;
    }
    // An empty queue tells exactly what it lost; the arrivals before it may have been too early to.
    trace().overwritten(reader_->delivery().count().overwritten());
    return false;
  }
  static trace::Callback::Release release_by(const MessageInfo& message) noexcept {
    return {.kind = ReleaseKind::data,
            .release_ns = message.arrival_ns,
            .source_timestamp_realtime_ns = message.source_timestamp_realtime_ns,
            .writer_gid = message.writer_gid};
  }
  void dispose() noexcept override {
    reader_->delivery().set_trace(nullptr);
    trace().overwritten(reader_->close());
  }

  Reader& reader() noexcept { return *reader_; }

 private:
  static constexpr std::int64_t kAtOnce = 0;

  std::unique_ptr<Reader> reader_;
  MessagePool messages_;
  KeptMessages kept_;
};

}  // namespace cie::executor
