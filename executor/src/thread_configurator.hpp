// Which threads have which parameters: gives them, watches them, changes them.
#pragma once

#include <cie/executor/executor.hpp>
#include <cie/tracepoints/priority_mutex.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/trace.hpp>

#include "exclusive_cpusets.hpp"
#include "kernel_view.hpp"

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cie::executor {

// Whose entry of the spec a thread takes: that of the first of these callbacks that has one;
// without callbacks, that of its name.
struct SpecSubject {
  std::string name;                      // of the thread
  std::vector<std::string> callbacks{};  // logical ids
};

// Thread-safe.
class ThreadConfigurator {
 public:
  explicit ThreadConfigurator(const ExecutorOptions& options)
      : options_(options), spec_(options.spec) {}

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
    std::vector<ParameterProblem> problems;
  };

  // Asks the kernel for what the spec wants of the thread, emits the `applied` read-back, compares
  // it, and passes the problems to the handler. Any thread of this process may be configured.
  Configured configure(trace::Thread& thread, const SpecSubject& subject);
  // The same for a thread that ends without a word: the interest in it ends with its trace::Thread.
  std::vector<ParameterProblem> configure(const std::shared_ptr<trace::Thread>& thread,
                                          const SpecSubject& subject);
  // One thread cannot run as two entries say. Passes what it finds to the handler.
  std::vector<ParameterProblem> conflicts(const SpecSubject& subject);

  // What the options ask of memory: for the process, and, on the calling thread, of its stack.
  // Passes what goes wrong to the handler.
  std::vector<ParameterProblem> lock_process_memory();
  std::vector<ParameterProblem> prepare_stack(const std::string& thread);

  // From now on threads run as `spec` (null: none) says. Of those that run already only what it
  // asks otherwise is changed; what it no longer asks for goes back to what the thread began with.
  // Under OnError::refuse, if one thing is refused, all is put back and ParametersRefused is
  // thrown.
  void reload(std::shared_ptr<const SchedulingSpec> spec);

  // Reads every thread back, emits it as audit, and tells the handler what somebody else changed,
  // once; asks for it again if the options say so.
  void audit();

  std::vector<ParameterProblem> problems() const;
  // Why the system gave no thread, in words.
  std::string why_no_thread(int error) const;

 private:
  struct Change;

  Members::iterator join(trace::Thread& thread, const SpecSubject& subject,
                         std::vector<ParameterProblem>& problems);
  void leave(Members::iterator member);
  void report(const std::vector<ParameterProblem>& problems);
  // With members_mutex_ held.
  std::vector<ParameterProblem> apply(Member& member);
  std::vector<Change> take(const SpecPtr& spec);
  std::vector<ParameterProblem> make(std::vector<Change>& changes);
  std::vector<ParameterProblem> put_back(const std::vector<Change>& changes);
  std::vector<ParameterProblem> audit(Member& member);
  void drop_orphans();

  const ExecutorOptions& options_;
  KernelView kernel_;
  ExclusiveCpusets cpusets_{kernel_};

  // Held while a thread is configured; real-time threads wait for it when they begin and end.
  PriorityMutex members_mutex_;  // of what follows
  SpecPtr spec_;
  Members members_;

  mutable std::mutex problems_mutex_;  // of what follows, and of the handler
  std::vector<ParameterProblem> problems_;
};

}  // namespace cie::executor
