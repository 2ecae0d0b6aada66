// Which instances may begin.
#pragma once

#include <cie/scheduling/clock.hpp>
#include <cie/scheduling/wakeup.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <utility>

namespace cie_rclcpp {

// Of one executor, asked by its threads before they take anything. Closed none begins, open all do; between the
// two are rounds, in which so many begin as were let in. All of it may be called from any thread, but for
// rounds and waiting, which are the spinning thread's.
class Admission {
 public:
  // What one queue may begin in a round.
  struct Share {
    std::uint64_t left = 0;
    std::uint64_t round = 0;
  };

  // From now on all may begin; unless `is_cancelled`, which is asked so that a close() that follows
  // whatever it tells of comes later.
  void open(const std::function<bool()>& is_cancelled);
  // None begins any more when this returns; those that run, run on.
  void close() noexcept;
  // Until none runs. Closed before.
  void wait_until_idle() const noexcept;

  // Begins a round in which none is let in yet; unless `is_cancelled`, likewise. Idle before.
  bool begin_round(const std::function<bool()>& is_cancelled);
  void let_in(Share& share, std::uint64_t instances) noexcept;
  // Until all that were let in have run, or found nothing to run; until close() or the deadline.
  void wait_for_round(std::int64_t deadline_ns) noexcept;
  // How many instances began in it.
  std::uint64_t begun() const noexcept { return begun_.load(); }
  // Closed: until somebody would begin, until wake(), or until the deadline.
  void wait_for_interest(std::int64_t deadline_ns) noexcept { wakeup_.wait_until(deadline_ns); }
  void wake() noexcept { wakeup_.notify(); }

  // Whether a share's queue is worth a look.
  bool admits(const Share& share) noexcept;
  // The queue goes, and leaves its share.
  void drop(Share& share) noexcept;

  // An attempt to run an instance. One that an exception leaves is over when that was handed over, or whoever waits
  // for idleness would not see it: see leave_after_failure().
  class Entry {
   public:
    Entry(Admission& admission, Share& share) noexcept
        : admission_(admission), share_(share), is_let_in_(admission.enter(share)) {}
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;
    ~Entry() {
      if (!is_let_in_) return;
      if (std::uncaught_exceptions() > exceptions_) {
        admission_.postpone(share_, has_begun_);
      } else {
        admission_.leave(share_, has_begun_);
      }
    }
    explicit operator bool() const noexcept { return is_let_in_; }
    // The instance begins now.
    void begin() noexcept {
      has_begun_ = true;
      admission_.begin();
    }

   private:
    Admission& admission_;
    Share& share_;
    const int exceptions_ = std::uncaught_exceptions();
    const bool is_let_in_;
    bool has_begun_ = false;
  };
  // Ends the calling thread's entry that an exception left.
  void leave_after_failure() noexcept;

 private:
  enum class Mode : std::uint8_t { closed, round, open };
  // What threads do, in one word: that looks for an instance, and runs one.
  static constexpr std::uint64_t kLooking = 1;
  static constexpr std::uint64_t kRunning = std::uint64_t{1} << 32;

  bool enter(Share& share) noexcept;
  void begin() noexcept;
  void leave(Share& share, bool has_begun) noexcept;
  void postpone(Share& share, bool has_begun) noexcept;
  void change(std::uint64_t by) noexcept;
  bool try_claim(Share& share) noexcept;
  void settle(std::uint64_t instances) noexcept;  // with mutex_ held

  std::atomic<Mode> mode_{Mode::closed};
  std::atomic<std::uint64_t> busy_{0};
  std::atomic<std::uint64_t> begun_{0};
  cie::scheduling::Wakeup wakeup_;  // of the spinning thread
  cie::PriorityMutex mutex_;        // of what follows, of shares and of changes of the mode
  std::uint64_t round_ = 0;
  std::uint64_t unsettled_ = 0;  // let in, and not done with
};

// Something that waits to be run: a callback, or a queue of rclcpp's own.
class Admitted {
 public:
  explicit Admitted(std::shared_ptr<Admission> admission) noexcept
      : admission_(std::move(admission)) {}
  Admitted(const Admitted&) = delete;
  Admitted& operator=(const Admitted&) = delete;
  virtual ~Admitted() = default;

  // How many instances wait; and since when the first does or, of a timer, from when on. CLOCK_MONOTONIC;
  // kNever: none.
  virtual std::uint64_t waiting() const noexcept = 0;
  virtual std::int64_t ready_at() const noexcept = 0;
  // Has its thread look.
  virtual void wake() noexcept = 0;

  void let_in(std::uint64_t instances) noexcept { admission_->let_in(share_, instances); }

 protected:
  void leave_after_failure() noexcept { admission_->leave_after_failure(); }
  Admission::Entry enter() noexcept { return {*admission_, share_}; }
  bool is_admitted() const noexcept { return admission_->admits(share_); }
  void leave_share() noexcept { admission_->drop(share_); }

 private:
  const std::shared_ptr<Admission> admission_;
  Admission::Share share_;
};

}  // namespace cie_rclcpp
