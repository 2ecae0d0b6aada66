// What the user asks of cie-record.
#pragma once

#include <cie/tracepoints/recording_layout.hpp>

#include "base/network_address.hpp"
#include "kernel/kernel_source.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cie::record {

// Which session daemon records.
//   own:    one of this recording's, which only the command and its children register with
//   shared: the user's (root: the machine's), started when none runs
// Own as root takes a mount namespace, which a container may forbid: own_if_possible then shares.
enum class DaemonChoice { own, own_if_possible, shared };

// Whether the kernel's scheduler is recorded too: automatic records it where that is possible.
enum class KernelChoice { automatic, yes, no };

// Bytes that one event of this project takes at most on average, header and contexts included
// (19 to 60).
inline constexpr double kBytesPerEvent = 48;

// The last seconds are kept in memory, and saved when something happens.
struct SnapshotOptions {
  std::chrono::milliseconds length{};
  std::uint64_t event_rate = 20'000;  // events per second and CPU that the memory is for
  std::uint64_t most = 10;            // saved unasked; those saved on command do not count
  std::chrono::milliseconds least_interval{10'000};  // between the one before and one unasked
};

// What is between an event for which something is saved and the beginning of the saving: less than half
// of the time that is kept.
struct SnapshotPace {
  std::chrono::milliseconds look{};         // how often it is looked whether there was one
  std::chrono::milliseconds aftermath{};    // for what comes after it
  std::chrono::milliseconds description{};  // for processes, to describe themselves
};
constexpr SnapshotPace pace_of(std::chrono::milliseconds length) noexcept {
  using std::chrono::milliseconds;
  return {.look = std::min<milliseconds>(milliseconds(100), length / 20),
          .aftermath = std::min<milliseconds>(milliseconds(250), length / 5),
          .description = std::min<milliseconds>(milliseconds(200), length / 5)};
}
// From the first CPU's buffer to the last one's, when a busy machine saves them (measured).
inline constexpr std::chrono::milliseconds kRaggedEnd{250};
// Of less, what it is saved for may be overwritten before all of it is saved.
inline constexpr std::chrono::milliseconds kLeastSnapshot{500};

// The recording is divided into chunks while it goes on.
struct RotateOptions {
  std::chrono::milliseconds interval{};
  std::uint64_t most = 0;  // chunks kept; 0: all
};

// Which events of ROS 2's tracers are recorded.
//   applications: those that programs of ROS 2 emit themselves
//   profile:      those that programs of this project emit, asked by the profile `ros2`
enum class Ros2Events { no, applications, profile };

struct Options {
  std::filesystem::path directory;   // absolute; holds the recording, or only what is said of it
  std::vector<std::string> command;  // empty: attach
  bool preserves_status = false;     // of what succeeded: ends with the command's own
  DaemonChoice daemon = DaemonChoice::own;
  KernelChoice kernel = KernelChoice::automatic;
  std::string no_kernel_because;  // with KernelChoice::no: which option decided; empty: --kernel
  KernelRoute kernel_route = KernelRoute::best;
  std::uint64_t kernel_buffer_size = 4 << 20;  // bytes per CPU
  std::vector<std::string> events{
      "cie:*"};  // patterns of LTTng, recorded into the channel "events"
  Ros2Events ros2 = Ros2Events::no;
  std::uint64_t subbuf_size = kDefaultSubbufSize;  // bytes, a power of two, per sub-buffer
  std::uint64_t num_subbuf = kDefaultSubbufs;      // a power of two, sub-buffers per CPU
  // How often buffers and metadata reach the disk: what a killed consumer daemon can cost.
  std::chrono::milliseconds flush_interval{1000};
  std::chrono::milliseconds registration_timeout{5000};
  std::optional<SnapshotOptions> snapshot;            // empty: everything is written
  std::optional<RotateOptions> rotate;                // empty: one recording
  std::optional<std::chrono::milliseconds> duration;  // attach: until then; empty: until a signal
  std::optional<NetworkAddress> relay;                // streams there; empty: writes a directory
  int live_socket = -1;  // streams instead of recording, for who is at the other end
  std::chrono::milliseconds live_interval{200};  // how often what was traced is sent then

  bool is_attach() const noexcept { return command.empty(); }
};

}  // namespace cie::record
