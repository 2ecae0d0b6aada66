// The components of one process, and the executor that serves them.
#pragma once

#include <cie/executor/context.hpp>
#include <cie/executor/executor.hpp>

#include "app_file.hpp"
#include "component_loader.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace cie::container {

// Thread-safe but for run().
class Container {
 public:
  // Told one line at a time, from any thread: what was loaded, what could not be, what went wrong.
  using Say = std::function<void(const std::string& line)>;

  // Throws SpecError, std::runtime_error or std::invalid_argument for what the whole process needs:
  // spec, network.
  Container(const AppFile& app, Say say);
  ~Container();
  Container(const Container&) = delete;
  Container& operator=(const Container&) = delete;

  // Loads what the file names and says of each whether it could be. Returns how many are there.
  std::size_t load_all();
  // Serves the components until cancel(). Throws ParametersRefused when the spec cannot be applied.
  void run();
  void cancel() noexcept;  // async-signal-safe

  // Instances that ended by an exception.
  std::uint64_t failures() const;

 private:
  struct Member {
    std::string name;  // "/ns/name"
    std::unique_ptr<LoadedComponent> component;
  };

  // Throws std::runtime_error saying which component and why.
  void load(const ComponentEntry& entry);
  void count_failure(const CallbackFailure& failure);

  const AppFile app_;
  const Say say_;
  Context context_;
  mutable std::mutex failures_mutex_;
  std::map<std::string, std::uint64_t> failures_;  // by logical id
  std::unique_ptr<Executor> executor_;
  std::mutex mutex_;  // of the members
  std::vector<Member> members_;
};

}  // namespace cie::container
