// The threads that a user asked for beside those of callbacks.
#pragma once

#include <cie/scheduling/failure.hpp>
#include <cie/scheduling/thread_configurator.hpp>

#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

namespace cie::scheduling {

// A thread that returns lets go of its function, and its stack goes when the next one returns.
// Thread-safe. end() comes before destruction.
class SpawnedThreads {
 public:
  using Function = std::function<void(std::stop_token)>;

  // Both outlive the threads.
  SpawnedThreads(ThreadConfigurator& configurator, FailureHandler& failures)
      : configurator_(configurator), failures_(failures) {}

  // Starts a thread and configures it. Under OnError::refuse throws SchedulingRefused, and then the
  // function never runs. Throws std::invalid_argument for what cannot be a name.
  void start(const std::string& name, Function function);
  // Asks all to stop and joins them; final.
  void end();

 private:
  struct Spawned;
  using SpawnedPtr = std::shared_ptr<Spawned>;

  void run(Spawned& spawned) noexcept;
  // The calling thread is that one, and about to return.
  void retire(Spawned& spawned) noexcept;

  ThreadConfigurator& configurator_;
  FailureHandler& failures_;
  std::mutex mutex_;  // of what follows
  bool has_ended_ = false;
  std::vector<SpawnedPtr> threads_;  // that have not returned
  SpawnedPtr returned_;              // the last one, not joined yet
};

}  // namespace cie::scheduling
