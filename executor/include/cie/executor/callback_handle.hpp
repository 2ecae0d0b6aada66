// What the handles of all kinds of callbacks have in common.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <memory>
#include <string>
#include <utility>

namespace cie::executor {

class NodeState;

// `Kind` is a class that the library alone knows, and instantiates this for.
template <typename Kind>
class CallbackHandle {
 public:
  explicit CallbackHandle(std::shared_ptr<Kind> callback) : callback_(std::move(callback)) {}

  const std::string& logical_id() const noexcept;
  CallbackId id() const noexcept;

  // For the classes of this library: ends the callback, see Node::remove().
  void remove_from(NodeState& node) const;

 protected:
  std::shared_ptr<Kind> callback_;
};

}  // namespace cie::executor
