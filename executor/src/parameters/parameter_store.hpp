// The parameters of one node.
#pragma once

#include <cie/executor/parameters.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include <atomic>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace cie::executor {

// Thread-safe. Asking takes one short lock with priority inheritance. Setting is one at a time, and
// so are the callbacks that are asked; asking goes on while they run.
class ParameterStore {
 public:
  enum class Change : std::uint8_t { declared, set, undeclared };
  // Told of every change, in order; must not call the store.
  using ChangeSink = std::function<void(Change change, const std::vector<Parameter>& parameters)>;

  ParameterStore(std::string node, ParameterOverrides overrides, ChangeSink change_sink = {})
      : node_(std::move(node)),
        overrides_(std::move(overrides)),
        change_sink_(std::move(change_sink)) {}

  // Functions that throw ParameterError: see Node.
  ParameterValue declare(std::string_view name, ParameterValue value,
                         ParameterDescriptor descriptor);
  void undeclare(std::string_view name);
  bool has(std::string_view name) const;
  ParameterValue get(std::string_view name) const;
  ParameterDescriptor describe(std::string_view name) const;
  // Either all of them, or none.
  SetParametersResult set(const std::vector<Parameter>& parameters);
  // Names that begin with one of the prefixes (none: all) and a dot, or are one; not more than
  // `depth` dots behind the prefix (0: any number). Ascending.
  std::vector<std::string> list(const std::vector<std::string>& prefixes = {},
                                std::uint64_t depth = 0) const;

  // In service until the handle goes.
  std::shared_ptr<void> add_on_set(OnSetParameters function);
  std::shared_ptr<void> add_post_set(PostSetParameters function);

  // Overrides of parameters that were not declared so far: misspelt ones, most likely.
  std::vector<std::string> unused_overrides() const;

 private:
  struct Declared {
    ParameterValue value;
    ParameterDescriptor descriptor;
  };
  // A function of a user's. Whoever takes it out of service waits for those who run it, but not for
  // itself.
  template <typename Function>
  struct Registered {
    explicit Registered(Function of_user) : function(std::move(of_user)) {}
    std::recursive_mutex mutex;  // of what follows
    Function function;           // empty when it is out of service
    int running = 0;
  };
  template <typename Function>
  using Functions = std::list<std::shared_ptr<Registered<Function>>>;

  // One change of the store, from asking the callbacks to telling the sink. Throws std::logic_error
  // when a callback that is asked wants to change something itself.
  class Changing;

  [[noreturn]] void fail(std::string_view name, const std::string& what) const;
  const Declared& find(std::string_view name) const;  // with values_mutex_ held
  SetParametersResult check(const std::vector<Parameter>& parameters) const;
  SetParametersResult ask(const std::vector<Parameter>& parameters) const;
  template <typename Function>
  std::shared_ptr<void> add(Functions<Function>& functions, Function function);
  template <typename Function>
  std::vector<std::shared_ptr<Registered<Function>>> copy(
      const Functions<Function>& functions) const;
  // What it returns is the function's; empty if that is out of service.
  template <typename Result, typename Function>
  static Result call(Registered<Function>& registered, const std::vector<Parameter>& parameters);

  const std::string node_;
  const ParameterOverrides overrides_;
  const ChangeSink change_sink_;
  std::mutex changing_mutex_;
  std::atomic<std::thread::id> changing_{};  // who holds it
  mutable PriorityMutex values_mutex_;       // of what follows
  std::map<std::string, Declared, std::less<>> declared_;
  std::set<std::string, std::less<>> ever_declared_;
  // Lives as long as one of its handles does, even if the store is gone.
  struct Callbacks {
    std::mutex mutex;
    Functions<OnSetParameters> on_set;
    Functions<PostSetParameters> post_set;
  };
  const std::shared_ptr<Callbacks> callbacks_ = std::make_shared<Callbacks>();
};

}  // namespace cie::executor
