// The seam that all executors share: something that can run one instance and say when it is next
// due, and somebody who is told that it became ready.
#pragma once

#include <cie/scheduling/cancellation.hpp>
#include <cie/scheduling/threads.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/schema.hpp>
#include <cie/tracepoints/trace.hpp>

#include <atomic>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cie::scheduling {

class Callback;

// Told from the thread that made the callback ready; must neither block nor throw.
class ReadySink {
 public:
  ReadySink() = default;
  ReadySink(const ReadySink&) = delete;
  ReadySink& operator=(const ReadySink&) = delete;
  virtual ~ReadySink() = default;
  virtual void on_ready(Callback& callback) noexcept = 0;
};

// A callback group: its announcement, shared by the callbacks in it.
class GroupState {
 public:
  GroupState(NodeId node, GroupType type) : type_(type), trace_(node, type) {}
  GroupType type() const noexcept { return type_; }
  GroupId id() const noexcept { return trace_.id(); }

 private:
  GroupType type_;
  trace::Group trace_;
};

// Shared by whoever made it, by the user's handles, and while it is served by a loop. The loop of a
// mutually exclusive group calls execute_one() from one thread at a time; that of a reentrant group
// from several at once. A derived class is final, and its destructor calls end().
class Callback {
 public:
  Callback(std::shared_ptr<GroupState> group, trace::CallbackInfo info)
      : group_(std::move(group)),
        logical_id_(info.logical_id),
        label_(thread_label(info)),
        kind_(info.kind),
        period_ns_(info.period_ns),
        trace_(std::make_unique<trace::Callback>(std::move(info))),
        id_(trace_->id()) {}
  Callback(const Callback&) = delete;
  Callback& operator=(const Callback&) = delete;
  virtual ~Callback() = default;

  // Runs one instance if one is released, the callback is not closed and nobody cancelled, and says
  // whether it did. What the user's function throws passes through, after the instance ended with
  // status exception.
  bool execute_one(const Cancellation* cancellation = nullptr);
  // CLOCK_MONOTONIC of the next timer expiry; kNever for what is not a timer.
  virtual std::int64_t next_due() const noexcept = 0;
  // Begins to be served: readiness goes to `sink`, which is told at once, because what came before
  // was not announced. Null ends it; then no on_ready() is running when this returns.
  virtual void serve(ReadySink* sink) = 0;
  // These are about to serve it. If others did before, the trace gets its `callback_init` again: the
  // move is no fault (rule M4). One thread at a time.
  void move_to(ThreadsId threads);

  // No instance begins any more; what runs, runs on. Thread-safe, for good.
  void close() noexcept { life_.fetch_or(kClosed); }
  bool is_closed() const noexcept { return (life_.load() & kClosed) != 0; }
  // Some thread runs an instance of it, or looks for one to run.
  bool is_running() const noexcept { return life_.load() >= kRunning; }
  // Closes it; the user's function is destroyed and callback_fini emitted, if an instance runs by the
  // last one to return. Thread-safe; may be called again.
  void begin_to_end() noexcept {
    close();
    try_dispose();
  }
  // The same, and waits for what runs. An instance that ends its own callback is not waited for, nor
  // one that waits in end() for an instance of the calling thread: the last instance to return does
  // the rest then.
  void end() noexcept;
  // Whether the calling thread is in an instance of a callback, of whichever executor.
  static bool is_in_instance() noexcept;
  struct Frame;
  // That the instances on the calling thread wait for others, for as long as it lives. Of those that
  // wait for each other, the one that began last is seen to wait in vain.
  class Waiting {
   public:
    // For every instance of these callbacks, and for all that are run under that cancellation.
    Waiting(const std::vector<std::shared_ptr<Callback>>& callbacks,
            const Cancellation* cancellation);
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;
    ~Waiting();
    // None of these can return before the calling thread goes on.
    bool is_in_vain() const noexcept { return is_in_vain_; }

   private:
    bool is_in_vain_;
  };

  // What its instance on this thread threw was handed over, for whoever waits for the instance to be done with.
  virtual void on_failure_handled() noexcept {}

  // Whether there may be more to run after an instance without a further on_ready().
  virtual bool has_queue() const noexcept { return true; }
  // How many instances wait in the queue, about: whether it is worth another thread to look.
  virtual std::uint64_t queued() const noexcept { return 0; }
  // Whether next_due() is ever something else than kNever.
  virtual bool has_timer() const noexcept { return false; }

  CallbackId id() const noexcept { return id_; }
  const std::string& logical_id() const noexcept { return logical_id_; }
  CallbackKind kind() const noexcept { return kind_; }
  SpecCallback in_spec() const { return {logical_id_, period_ns_}; }
  // What its thread is called: at most 15 bytes.
  const std::string& label() const noexcept { return label_; }
  GroupState& group() const noexcept { return *group_; }

  // The ready mark belongs to the sink: it sets it, and its loop takes it.
  void mark_ready() noexcept { is_ready_.store(true, std::memory_order_release); }
  // False if it was set. Either way whoever takes the mark sees what the caller wrote before.
  bool try_mark_ready() noexcept { return !is_ready_.exchange(true, std::memory_order_acq_rel); }
  bool take_ready_mark() noexcept {
    return is_ready_.load(std::memory_order_relaxed) &&
           is_ready_.exchange(false, std::memory_order_acq_rel);
  }
  // The next one in a queue of ready callbacks, for the sink that set the mark.
  Callback* next_ready() const noexcept { return next_ready_; }
  void set_next_ready(Callback* next) noexcept { next_ready_ = next; }

 protected:
  // What execute_one() says, of a callback that is not closed.
  virtual bool run_one() = 0;
  // In run_one(): whether the instance may begin, nobody having cancelled meanwhile. Asked last
  // before the instance; if not, what was taken for it is kept for the next spin.
  static bool may_begin() noexcept;
  // Lets go of what only instances need: the user's function. Called once, by end() or the last
  // instance, when none runs or will.
  virtual void dispose() noexcept {}

  // Until dispose() has returned.
  trace::Callback& trace() noexcept { return *trace_; }

  // One instance: from its start event to its end event, whichever way it ends.
  class Instance {
   public:
    Instance(Callback& callback, const trace::Callback::Release& release) noexcept
        : callback_(callback),
          seq_(callback.trace_->start(release)),
          release_ns_(release.release_ns) {}
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;
    ~Instance() {
      const bool is_unwinding = std::uncaught_exceptions() > exceptions_;
      callback_.trace_->end(seq_, is_unwinding ? CallbackStatus::exception : CallbackStatus::ok,
                            release_ns_);
    }

   private:
    Callback& callback_;
    std::uint64_t seq_;
    std::int64_t release_ns_;
    int exceptions_ = std::uncaught_exceptions();
  };

 private:
  class Execution;
  void try_dispose() noexcept;

  static constexpr std::uint32_t kClosed = 1;
  static constexpr std::uint32_t kDisposing = 2;
  static constexpr std::uint32_t kDisposed = 4;
  static constexpr std::uint32_t kRunning = 8;  // each running instance adds this

  std::shared_ptr<GroupState> group_;
  std::string logical_id_;
  std::string label_;
  CallbackKind kind_;
  std::uint64_t period_ns_;
  std::unique_ptr<trace::Callback> trace_;
  CallbackId id_;
  std::optional<ThreadsId> served_by_;
  std::atomic<std::uint32_t> life_{0};
  std::atomic<bool> is_ready_{false};
  Callback* next_ready_ = nullptr;
};

}  // namespace cie::scheduling
