// A subscription as a callback.
#pragma once

#include <cie/executor/subscription.hpp>

#include "callback.hpp"
#include "clock.hpp"
#include "reader.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

namespace cie::executor {

class SubscriptionCallback final : public Callback {
 public:
  SubscriptionCallback(std::shared_ptr<GroupState> group, trace::CallbackInfo info,
                       std::unique_ptr<Reader> reader, const dds_topic_descriptor& type,
                       MessageFunction function);
  ~SubscriptionCallback() override;

  bool execute_one() override;
  std::int64_t next_due() const noexcept override { return kNever; }
  void serve(ReadySink* sink) override;
  const Reader& reader() const noexcept { return *reader_; }

 private:
  using Message = std::shared_ptr<void>;
  enum class Spare : std::uint8_t { there, lent, moving };
  struct Lent {
    explicit Lent(SubscriptionCallback& lender) : owner(lender), message(lender.borrow_message()) {}
    Lent(const Lent&) = delete;
    Lent& operator=(const Lent&) = delete;
    ~Lent() { owner.give_back(std::move(message)); }
    SubscriptionCallback& owner;
    Message message;
  };
  Message new_message() const;
  // The message kept for reuse, or a new one when it is in use: by another thread of a reentrant
  // group, or by a user who kept the pointer.
  Message borrow_message();
  void give_back(Message message) noexcept;

  std::unique_ptr<Reader> reader_;
  const dds_topic_descriptor& type_;
  MessageFunction function_;
  Message spare_;
  std::atomic<Spare> spare_state_{Spare::there};
};

}  // namespace cie::executor
