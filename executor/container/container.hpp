// The components of one process, and the executor that serves them.
#pragma once

#include <cie/executor/cancel_on_signals.hpp>
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

// Thread-safe once all is loaded; callbacks must not call it.
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
  // A line for each component: name, class, library.
  std::string list() const;
  // Their names.
  std::vector<std::string> names() const;
  // What `function` makes of the component's node, which stays meanwhile. Throws std::runtime_error
  // if there is no such component.
  std::string with_node(const std::string& name,
                        const std::function<std::string(Node& node)>& function) const;
  // Reads the spec's file again and goes on under it. Returns what to tell the user. Throws
  // SpecError, std::runtime_error or SchedulingRefused when it cannot be used; the former stays in
  // force then.
  std::string reload_spec();
  bool has_spec() const noexcept;
  // Serves the components until a signal cancels. Throws SchedulingRefused when the spec cannot be
  // applied.
  void run();
  void cancel_on(CancelOnSignals& signals) { signals.add(*executor_); }

  // Instances that ended by an exception.
  std::uint64_t failures() const;

 private:
  struct Member {
    std::string name;  // "/ns/name"
    std::unique_ptr<LoadedComponent> component;
  };

  std::shared_ptr<const SchedulingSpec> load_spec() const;
  void check_machine(const SchedulingSpec& spec) const;
  void count_failure(const CallbackFailure& failure);

  const AppFile app_;
  const Say say_;
  Context context_;
  mutable std::mutex failures_mutex_;
  std::map<std::string, std::uint64_t> failures_;  // by logical id
  std::unique_ptr<Executor> executor_;
  std::vector<Member> members_;
};

}  // namespace cie::container
