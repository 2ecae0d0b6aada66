// A system that the simulator runs: processors, processes, threads, callbacks and what links them.
// Plain data; indices are into the vectors of System. All times are nanoseconds.
#pragma once

#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/schema.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace cie::sim {

using Ns = std::int64_t;

// An amount drawn anew each time.
struct Range {
  Ns least = 0;
  Ns most = 0;
};

// What a callback, or a thread beside the callbacks, does, step by step.
struct Compute {
  Range time{};  // on a processor
};
struct Sleep {
  Range time{};  // blocked, as by a device
};
struct Lock {
  int mutex = 0;  // with priority inheritance
};
struct Unlock {
  int mutex = 0;
};
struct Send {
  int topic = 0;
};
using Step = std::variant<Compute, Sleep, Lock, Unlock, Send>;

struct Topic {
  std::string name{};
  bool is_local = true;  // the publishing thread delivers; else the process's receive thread
  Range transport{};     // until delivered
};

struct Callback {
  std::string id{};  // logical
  CallbackKind kind = CallbackKind::timer;
  int process = 0;
  int group = -1;  // -1: a mutually exclusive one of its own
  Ns period = 0;   // timers
  Ns phase = 0;
  int topic = -1;  // subscriptions
  std::size_t depth = 10;
  Ns deadline = 0;            // declared; 0: none
  bool tells_release = true;  // callback_start carries it
  bool tells_source = true;   // callback_start names the message
  std::vector<Step> steps{};
};

struct Group {
  int process = 0;
  bool is_reentrant = false;
};

// A thread that runs callbacks; isolated: exactly one, and announced for it.
struct Server {
  std::string name{};
  int process = 0;
  bool is_isolated = true;
  std::vector<int> callbacks{};
  ThreadParameters parameters{};  // policy and cpus are always there
};

// A thread that no event of ours tells of.
struct Load {
  ThreadParameters parameters{};
  Ns period = 0;
  std::vector<Step> steps{};
};

struct System {
  int cpus = 1;
  int processes = 1;
  int mutexes = 0;
  std::vector<Topic> topics{};
  std::vector<Group> groups{};
  std::vector<Callback> callbacks{};
  std::vector<Server> servers{};
  std::vector<Load> loads{};
  ThreadParameters receiver{};  // of each process's receive thread
  Ns duration = 0;              // then everything is asked to stop
  std::optional<Ns> attach{};   // state is announced at this time, as when a recording begins then
  std::uint64_t seed = 0;       // of all amounts that are drawn
};

}  // namespace cie::sim
