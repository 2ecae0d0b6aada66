// Memory for messages that is used again.
#pragma once

#include <cie/executor/message.hpp>

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

namespace cie::executor {

// Keeps one message for reuse, which is all that a callback of a mutually exclusive group needs:
// then nothing is allocated. Thread-safe and lock-free.
class MessagePool {
 public:
  using MessageHandle = std::shared_ptr<void>;

  // One message on loan: it returns when this goes, unless somebody kept the handle.
  class Lent {
   public:
    explicit Lent(MessagePool& pool) : pool_(pool), message_(pool.borrow()) {}
    Lent(const Lent&) = delete;
    Lent& operator=(const Lent&) = delete;
    ~Lent() { pool_.give_back(std::move(message_)); }
    const MessageHandle& handle() const noexcept { return message_; }
    void* get() const noexcept { return message_.get(); }

   private:
    MessagePool& pool_;
    MessageHandle message_;
  };

  // `type` outlives the pool and all its messages. Throws std::bad_alloc.
  explicit MessagePool(const dds_topic_descriptor& type) : type_(type), spare_(make()) {}

 private:
  enum class Spare : std::uint8_t { there, lent, moving };

  MessageHandle make() const;
  // The kept message, or a new one when it is in use: by another thread of a reentrant group, or by
  // a user who kept the handle.
  MessageHandle borrow();
  void give_back(MessageHandle message) noexcept;

  const dds_topic_descriptor& type_;
  MessageHandle spare_;
  std::atomic<Spare> state_{Spare::there};
};

}  // namespace cie::executor
