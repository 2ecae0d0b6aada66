// Memory for messages that is used again.
#pragma once

#include "message_layout.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

namespace cie::executor {

// Keeps one message for reuse, which is all that a callback of a mutually exclusive group needs:
// then nothing is allocated. Thread-safe and lock-free.
class MessagePool {
 public:
  using MessageHandle = std::shared_ptr<const void>;

  // What one instance of a callback works on: a message of the pool, which returns when this goes
  // unless somebody kept the handle, or a message that is somebody else's.
  class Loan {
   public:
    explicit Loan(MessagePool& pool) noexcept : pool_(pool) {}
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    ~Loan() { give_back(); }
    // The pool's, to write to; the same one when called again. Throws std::bad_alloc.
    void* memory() {
      if (memory_ == nullptr) {
        message_ = pool_.borrow();
        memory_ = const_cast<void*>(message_.get());  // the pool's own, and so not const
      }
      return memory_;
    }
    // Somebody else's, instead of the pool's.
    void refer_to(MessageHandle message) noexcept {
      give_back();
      message_ = std::move(message);
    }
    const MessageHandle& handle() const noexcept { return message_; }
    const void* get() const noexcept { return message_.get(); }

   private:
    void give_back() noexcept {
      if (std::exchange(memory_, nullptr) != nullptr) pool_.give_back(std::move(message_));
    }

    MessagePool& pool_;
    MessageHandle message_;
    void* memory_ = nullptr;  // of message_; null: it is somebody else's
  };

  // Throws std::bad_alloc.
  explicit MessagePool(LayoutPtr layout) : layout_(std::move(layout)), spare_(make()) {}

 private:
  enum class Spare : std::uint8_t { there, loaned, moving };

  MessageHandle make() const { return own_message(layout_->allocate(), layout_); }
  // The kept message, or a new one when it is in use: by another thread of a reentrant group, or by
  // a user who kept the handle.
  MessageHandle borrow();
  void give_back(MessageHandle message) noexcept;

  LayoutPtr layout_;
  MessageHandle spare_;
  std::atomic<Spare> state_{Spare::there};
};

}  // namespace cie::executor
