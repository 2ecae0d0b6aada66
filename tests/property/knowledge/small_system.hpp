// A system small enough that all of its executions can be enumerated: one process, three callbacks, three thread numbers,
// two CPUs, at most one event per tick. What may happen in it, what each rule calls a violation, random executions, and
// what a gap takes of one.
#pragma once

#include "knowledge/event_kinds.hpp"

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace cie::test::small {

using analysis::EventKind;
using analysis::EventKinds;

constexpr int kCallbacks = 3;
constexpr int kThreads = 3;
constexpr int kCpus = 2;
constexpr int kNone = -1;
constexpr int kUnannounced = -2;  // life of a thread that nobody announced
constexpr int kForever = 1'000'000;
constexpr int kAsSpecified = 1;  // S1's value
constexpr int kOtherwise = 2;
constexpr int kDeadline = 11;  // R3
constexpr int kAllowed = 0;    // periods skipped, R2
constexpr int kPace = 4;       // ticks between events, so that whatever a gap hides has room there
constexpr int kTicks = 14 * kPace;

// Something of each callback, or of each thread number.
template <typename T, std::size_t kCount>
struct Per {
  std::array<T, kCount> values{};
  T& at(int number) { return values.at(static_cast<std::size_t>(number)); }
  const T& at(int number) const { return values.at(static_cast<std::size_t>(number)); }
  auto begin() const { return values.begin(); }
  auto end() const { return values.end(); }
  friend auto operator<=>(const Per&, const Per&) = default;
};

enum class Rule : std::uint8_t { m2, m3, m4, m7, m9, s1, s3, s3_by_read_back, e2, e3, r2, r3 };
inline constexpr std::array kRules{Rule::m2, Rule::m3, Rule::m4, Rule::m7, Rule::m9, Rule::s1,
                                   Rule::s3, Rule::e2, Rule::e3, Rule::r2, Rule::r3};
std::string name_of(Rule rule);
bool is_of_threads(Rule rule);

struct Event {
  EventKind kind{};
  int time = 0;
  int cpu = 0;
  int callback = kNone;
  int tid = kNone;
  int n =
      0;  // seq of a run, number of a read-back, next_seq of a registration; starts, threads of totals
  int ended = 0;     // callback_exit: ends
  int life = kNone;  // announcement: which life of the thread number; process_exit: announcements
  int value = 0;     // parameters or priority; of a start: periods missed
  int release = 0;   // of a start
  friend bool operator==(const Event&, const Event&) = default;
};

struct World {
  Per<unsigned, kThreads> cpus{};     // bits: the CPUs that each thread may use
  Per<char, kCallbacks> ids{};        // logical ids
  Per<unsigned, kCallbacks> homes{};  // bits: where lost runs are presumed; 0: anywhere
};

struct Loss {
  EventKinds kinds{};
  int begin = 0;
  int end = 0;
  int cpu = kNone;  // any
  std::optional<int> at_most{};
};

struct Recording {
  World world{};
  std::vector<Event> events{};
  std::vector<Loss> losses{};
};

struct Thread {
  int life = kNone;
  bool is_on = false;
  int reads = 0;
  int applied = kNone;
  bool is_boosted = false;
  friend auto operator<=>(const Thread&, const Thread&) = default;
};

struct Run {
  int callback = 0;
  int seq = 0;
  int tid = 0;
  int release = 0;
  friend auto operator<=>(const Run&, const Run&) = default;
};

struct State {
  Per<int, kCallbacks> registered{};  // 0: not yet, 1: lives, 2: finished
  Per<int, kCallbacks> seqs{};
  Per<int, kCallbacks> ended{};
  std::vector<Run> open;  // in order
  Per<Thread, kThreads> threads{};
  int announced = 0;
  bool is_over = false;
  friend auto operator<=>(const State&, const State&) = default;

  // Behind the event; nothing if it cannot happen, or not with these numbers.
  std::optional<State> after(const World& world, const Event& event) const;
  // What can come next on that CPU; what the rule does not look at takes one value.
  std::vector<Event> possible(const World& world, int time, int cpu, Rule rule, bool at_home) const;
  int callbacks() const;
};

// What a rule remembers of the past, per callback or thread.
using Memory = Per<int, kThreads>;

// The subjects, as bits, that the event violates. `state`: before it.
unsigned violated(Rule rule, const World& world, Memory& memory, const State& state,
                  const Event& event);

// Those that the recording shows.
std::vector<int> subjects(const Recording& recording, Rule rule);

using Random = std::mt19937_64;
int below(Random& random, int bound);
double share(Random& random);

struct Execution {
  std::vector<Event> events;
  int end = 0;
};
// Sane most of the time; then an end in order or none.
Execution random_execution(const World& world, Random& random, bool has_kernel);

// Takes events from `events`; how many.
int lose(std::vector<Event>& events, const Loss& loss, Random& random, double taken);

// Where the callbacks are seen to run.
Per<unsigned, kCallbacks> homes(const std::vector<Event>& events);

std::string text_of(const Event& event);

}  // namespace cie::test::small
