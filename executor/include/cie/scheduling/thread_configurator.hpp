// Which threads have which parameters: gives them, watches them, changes them.
#pragma once

#include <cie/scheduling/exclusive_cpusets.hpp>
#include <cie/scheduling/kernel_calls.hpp>
#include <cie/scheduling/kernel_view.hpp>
#include <cie/scheduling/options.hpp>
#include <cie/scheduling/problem.hpp>
#include <cie/tracepoints/priority_mutex.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/trace.hpp>

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cie::scheduling {

// Whose entry of the spec a thread takes: that of the first of these callbacks that has one;
// without callbacks, that of its name.
struct SpecSubject {
  std::string name;  // of the thread
  std::vector<SpecCallback> callbacks{};
};

// What an executor has when it begins to spin.
struct KnownIds {
  std::vector<std::string> nodes{};  // fully qualified
  std::vector<SpecCallback> callbacks{};
  std::vector<std::string> threads{};  // names of those that are not of callbacks
};

// Thread-safe. The options, and the kernel, outlive it.
class ThreadConfigurator {
 public:
  explicit ThreadConfigurator(const ExecutorOptions& options)
      : ThreadConfigurator(options, own_calls_, KernelView{}) {}
  // For another machine than this one.
  ThreadConfigurator(const ExecutorOptions& options, KernelCalls& calls, KernelView kernel)
      : options_(options), calls_(calls), kernel_(std::move(kernel)), spec_(options.spec) {}

  using SpecPtr = std::shared_ptr<const SchedulingSpec>;

  // A thread that was configured.
  struct Member {
    trace::Thread* thread = nullptr;
    SpecSubject subject{};
    trace::SchedReadBack began{};      // what it ran as before
    SpecPtr spec{};                    // by which it runs
    const SpecEntry* entry = nullptr;  // of that spec
    ThreadParameters asked{};
    std::vector<std::string> told{};  // how it differs from that, as far as the handler was told
    std::optional<std::weak_ptr<trace::Thread>> owner{};
  };
  using Members = std::list<Member>;

  // Ends the configurator's interest in a thread; goes before the thread's trace::Thread does.
  class Membership {
   public:
    Membership() = default;
    Membership(ThreadConfigurator& configurator, Members::iterator member)
        : configurator_(&configurator), member_(member) {}
    Membership(Membership&& other) noexcept
        : configurator_(std::exchange(other.configurator_, nullptr)), member_(other.member_) {}
    Membership& operator=(Membership&&) = delete;
    ~Membership() {
      if (configurator_ != nullptr) configurator_->leave(member_);
    }

   private:
    ThreadConfigurator* configurator_ = nullptr;
    Members::iterator member_{};
  };
  struct Configured {
    Membership membership;
    std::vector<SchedulingProblem> problems;
  };

  // Asks the kernel for what the spec wants of the thread, emits the `applied` read-back, compares
  // it, and passes the problems to the handler. Any thread of this process may be configured.
  Configured configure(trace::Thread& thread, const SpecSubject& subject);
  // The same for a thread that ends without a word: the interest in it ends with its trace::Thread.
  std::vector<SchedulingProblem> configure(const std::shared_ptr<trace::Thread>& thread,
                                           const SpecSubject& subject);
  // One thread cannot run as two entries say. Passes what it finds to the handler.
  std::vector<SchedulingProblem> conflicts(const SpecSubject& subject);

  // What the options ask of memory: for the process, and, on the calling thread, of its stack.
  // Passes what goes wrong to the handler.
  std::vector<SchedulingProblem> lock_process_memory();
  std::vector<SchedulingProblem> prepare_stack(const std::string& thread);

  // From now on threads run as `spec` (null: none) says. Of those that run already only what it
  // asks otherwise is changed; what it no longer asks for goes back to what the thread began with.
  // Under OnError::refuse, if one thing is refused, all is put back and SchedulingRefused is
  // thrown.
  void reload(std::shared_ptr<const SchedulingSpec> spec);

  // Tells the handler which ids of the spec are probably misspelt, once for each spec. The threads'
  // names are those of the threads that were configured.
  void tell_misspelt(KnownIds known);

  // Reads every thread back, emits it as audit, and tells the handler what somebody else changed,
  // once; asks for it again if the options say so.
  void audit();

  // Throws SchedulingRefused if there are any, under OnError::refuse.
  void refuse_if_any(const std::vector<SchedulingProblem>& problems) const;

  std::vector<SchedulingProblem> problems() const;
  // Why the system gave no thread, in words that do not repeat those of the errno.
  std::string why_no_thread(int error) const;

 private:
  struct Change;

  Members::iterator join(trace::Thread& thread, const SpecSubject& subject,
                         std::vector<SchedulingProblem>& problems);
  void leave(Members::iterator member);
  void report(const std::vector<SchedulingProblem>& problems);
  // With members_mutex_ held.
  std::vector<SchedulingProblem> apply(Member& member);
  std::vector<Change> take(const SpecPtr& spec);
  std::vector<SchedulingProblem> make(std::vector<Change>& changes);
  std::vector<SchedulingProblem> put_back(const std::vector<Change>& changes);
  std::vector<SchedulingProblem> audit(Member& member);
  void drop_orphans();

  const ExecutorOptions& options_;
  KernelCalls own_calls_;
  KernelCalls& calls_;
  KernelView kernel_;
  ExclusiveCpusets cpusets_{kernel_};

  // Held while a thread is configured; real-time threads wait for it when they begin and end.
  PriorityMutex members_mutex_;  // of what follows
  SpecPtr spec_;
  SpecPtr checked_;  // for misspelt ids
  Members members_;

  mutable std::mutex problems_mutex_;  // of what follows, and of the handler
  std::vector<SchedulingProblem> problems_;
};

}  // namespace cie::scheduling
