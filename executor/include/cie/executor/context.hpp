// The process's place on the network: one DDS participant, shared by all nodes of the process.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace cie {

namespace executor {
class ContextState;
}

// How the process tells ROS 2 of its nodes and their endpoints (topic ros_discovery_info), so that
// `ros2 node list` and the like show them. Messages and services need none of it.
enum class RosGraph : std::uint8_t {
  none,
  humble,  // and before: identities of 24 bytes
  iron     // and later: of 16
};

// Create one per process, before any node, and keep it until the last node is gone (nodes hold it
// alive too). A second one of the same domain while the first lives throws std::logic_error.
class Context {
 public:
  static constexpr std::uint32_t kMostDomain = 232;  // of UDP's ports none is left for another

  struct Options {
    std::uint32_t domain = 0;  // 0..kMostDomain
    // Loopback interface only, without multicast; processes of this machine find each other. What
    // CYCLONEDDS_URI says is then ignored.
    bool loopback = false;
    // Participants with different tags do not see each other, even in one domain. Loopback only.
    std::string tag{};
    // Messages published by pointer reach subscriptions of this process by pointer (docs/design.md,
    // "Pointers"). False: all are serialised.
    bool pass_pointers = true;
    // Messages between processes of this machine go through shared memory (docs/nodes.md, "Shared
    // memory"); pass_pointers is then as good as false. Needs a running iox-roudi.
    bool shared_memory = false;

    // The form of announcements: that of the ROS 2 in the graph; another one sees no nodes' names.
    RosGraph ros_graph = RosGraph::humble;
    // Told, each thing once, what keeps messages away that nobody else is told of: QoS that do not
    // fit, texts that no message can hold. From threads of DDS, several at once: thread-safe, short,
    // and without calls of nodes. Empty: a line on stderr.
    std::function<void(const std::string&)> on_warning{};

    // CIE_DOMAIN_ID (else ROS_DOMAIN_ID, else 0), CIE_LOOPBACK (1 or 0), CIE_DISCOVERY_TAG,
    // CIE_SHARED_MEMORY (1 or 0), CIE_ROS_GRAPH (none, humble, iron; else what fits ROS_DISTRO,
    // else humble). Throws std::invalid_argument naming the variable that cannot be used.
    static Options from_environment();
  };

  // Throws std::runtime_error when the participant cannot be created or shared memory is not there,
  // std::invalid_argument for unusable options.
  explicit Context(const Options& options = Options::from_environment());
  ~Context();
  Context(Context&&) noexcept;
  Context& operator=(Context&&) noexcept;

  const Options& options() const noexcept;

  // For the classes of this library.
  const std::shared_ptr<executor::ContextState>& state() const noexcept { return state_; }

 private:
  std::shared_ptr<executor::ContextState> state_;
};

}  // namespace cie
