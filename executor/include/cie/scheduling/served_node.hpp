// A node, as an executor sees it, of whatever middleware.
#pragma once

#include <cie/scheduling/callback.hpp>
#include <cie/tracepoints/trace.hpp>

#include <memory>
#include <string>
#include <vector>

namespace cie::scheduling {

class ExecutorCore;

// A thread beside those of callbacks, one that DDS made for example, which a spec may name.
struct AnnouncedThread {
  std::string name;
  std::shared_ptr<trace::Thread> trace;
};

// Thread-safe. What it locks for this is never held while the executor's lock is taken.
class ServedNode {
 public:
  ServedNode() = default;
  ServedNode(const ServedNode&) = delete;
  ServedNode& operator=(const ServedNode&) = delete;
  virtual ~ServedNode() = default;

  virtual const std::string& name() const noexcept = 0;  // fully qualified
  virtual std::vector<std::shared_ptr<Callback>> callbacks() const = 0;
  // The threads that serve it beside those of callbacks.
  virtual std::vector<AnnouncedThread> workers() const = 0;

  // Membership. join() throws std::logic_error when the node has an executor.
  virtual void join(std::shared_ptr<ExecutorCore> executor) = 0;
  virtual void leave() = 0;
};

}  // namespace cie::scheduling
