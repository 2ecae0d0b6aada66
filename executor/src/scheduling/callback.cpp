#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/event_count.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include <algorithm>
#include <mutex>
#include <vector>

namespace cie::scheduling {

// An instance of a callback, or its end, on the stack of a thread.
struct Callback::Frame {
  Frame(const Callback* entered, const Cancellation* cancelled,
        const Frame*& innermost_frame) noexcept
      : callback(entered),
        cancellation(cancelled),
        outer(innermost_frame),
        innermost(innermost_frame) {
    innermost = this;
  }
  Frame(const Frame&) = delete;
  Frame& operator=(const Frame&) = delete;
  ~Frame() { innermost = outer; }

  const Callback* callback;
  const Cancellation* cancellation;  // null: it cannot be cancelled
  const Frame* outer;
  const Frame*& innermost;
};

namespace {

// Of the calling thread; null outside of all callbacks.
thread_local const Callback::Frame* innermost_of_thread = nullptr;

// A thread that waits for instances of a callback, or for those that are run under a cancellation.
struct Wait {
  const Callback::Frame* frames;
  const void* target;
};

struct Ends {
  PriorityMutex mutex;  // of what follows
  EventCount disposed;
  std::vector<Wait> waits;
};

// Never destroyed: callbacks may be, as the process ends.
Ends& ends() {
  static Ends& ends = *new Ends;
  return ends;
}

bool is_on(const Callback::Frame* frames, const void* target) noexcept {
  for (; frames != nullptr; frames = frames->outer) {
    if (frames->callback == target || frames->cancellation == target) return true;
  }
  return false;
}

// Whether `target` cannot end before the thread of `frames` goes on. With the mutex held.
bool waits_for(const void* target, const Callback::Frame* frames) {
  return is_on(frames, target) || std::ranges::any_of(ends().waits, [&](const Wait& wait) {
           return is_on(wait.frames, target) && waits_for(wait.target, frames);
         });
}

}  // namespace

// Outside of all instances nobody can wait for the calling thread: nothing is written down.
Callback::Waiting::Waiting(const std::vector<std::shared_ptr<Callback>>& callbacks,
                           const Cancellation* cancellation)
    : is_in_vain_(false) {
  const Frame* const frames = innermost_of_thread;
  if (frames == nullptr) return;
  std::vector<const void*> targets;
  for (const auto& callback : callbacks)
    targets.push_back(callback.get());
  if (cancellation != nullptr) targets.push_back(cancellation);
  const std::lock_guard lock{ends().mutex};
  is_in_vain_ = std::ranges::any_of(
      targets, [frames](const void* target) { return waits_for(target, frames); });
  if (is_in_vain_) return;
  for (const void* const target : targets)
    ends().waits.push_back({frames, target});
}

// A thread is in one wait at a time.
Callback::Waiting::~Waiting() {
  const Frame* const frames = innermost_of_thread;
  if (frames == nullptr || is_in_vain_) return;
  const std::lock_guard lock{ends().mutex};
  std::erase_if(ends().waits, [frames](const Wait& wait) { return wait.frames == frames; });
}

bool Callback::is_in_instance() noexcept { return innermost_of_thread != nullptr; }

bool Callback::may_begin() noexcept {
  const Cancellation* const cancellation = innermost_of_thread->cancellation;
  return cancellation == nullptr || !cancellation->is_cancelled();
}

// Counts the instance for as long as it may use what the callback holds.
class Callback::Execution {
 public:
  Execution(Callback& callback, const Cancellation* cancellation) noexcept
      : callback_(callback),
        frame_(&callback, cancellation, innermost_of_thread),
        is_open_((callback.life_.fetch_add(kRunning) & kClosed) == 0) {}
  Execution(const Execution&) = delete;
  Execution& operator=(const Execution&) = delete;
  ~Execution() {
    if (callback_.life_.fetch_sub(kRunning) == (kClosed | kRunning)) callback_.try_dispose();
  }
  bool is_open() const noexcept { return is_open_; }

 private:
  Callback& callback_;
  const Frame frame_;
  bool is_open_;
};

bool Callback::execute_one(const Cancellation* cancellation) {
  const Execution execution{*this, cancellation};
  return execution.is_open() && may_begin() && run_one();
}

void Callback::move_to(ThreadsId threads) {
  if (served_by_ && *served_by_ != threads) trace::register_again(id_);
  served_by_ = threads;
}

void Callback::try_dispose() noexcept {
  std::uint32_t unused = kClosed;
  if (!life_.compare_exchange_strong(unused, kClosed | kDisposing)) return;
  {
    const Frame frame{this, nullptr, innermost_of_thread};
    serve(nullptr);  // who makes it ready just now has done so
    dispose();
    trace_.reset();
  }
  const std::lock_guard lock{ends().mutex};
  life_.fetch_or(kDisposed);
  ends().disposed.notify_all();
}

void Callback::end() noexcept {
  begin_to_end();
  const auto is_disposed = [this] { return (life_.load() & kDisposed) != 0; };
  std::unique_lock lock{ends().mutex};
  if (is_disposed() || waits_for(this, innermost_of_thread)) return;
  auto& waits = ends().waits;
  waits.push_back({innermost_of_thread, this});
  ends().disposed.wait(lock, is_disposed);
  const auto own = std::ranges::find_if(waits, [this](const Wait& wait) {
    return wait.target == this && wait.frames == innermost_of_thread;
  });
  waits.erase(own);
}

}  // namespace cie::scheduling
