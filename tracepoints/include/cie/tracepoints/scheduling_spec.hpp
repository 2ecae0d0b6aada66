// The scheduling spec: what each callback's thread is meant to run as, and what its instances are
// meant to keep. The executor applies it, the verifier judges by it; both read it with this.
#pragma once

#include <cie/tracepoints/policy.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie {

// What a thread is asked to run as. An absent policy or affinity is neither applied nor judged.
struct ThreadParameters {
  std::optional<Policy> policy;
  std::int32_t nice = 0;                  // SCHED_OTHER and SCHED_BATCH, -20..19
  std::uint32_t priority = 0;             // SCHED_FIFO and SCHED_RR, 1..99
  std::uint64_t runtime_ns = 0;           // SCHED_DEADLINE
  std::uint64_t deadline_ns = 0;          // SCHED_DEADLINE
  std::uint64_t period_ns = 0;            // SCHED_DEADLINE
  std::optional<std::uint64_t> slice_ns;  // SCHED_OTHER, 100 us to 100 ms; absent: kernel's
  // Utilization clamps, 0..1024 and 1..1024, of any policy but SCHED_DEADLINE.
  std::optional<std::uint32_t> util_min;
  std::optional<std::uint32_t> util_max;
  std::optional<std::vector<std::uint32_t>> cpus;  // ascending, without repetition
  // SCHED_DEADLINE with affinity: the executor may make an exclusive cpuset of these CPUs, without
  // which the kernel refuses the two together.
  bool has_exclusive_cpuset = false;
  friend bool operator==(const ThreadParameters&, const ThreadParameters&) = default;
};

// One entry of `callback_groups` (id: a callback's logical id, exact or "<node>/*"), of
// `non_ros_threads` (id: a thread's name) or of `dds_threads` (id: the name of a thread of Cyclone
// DDS, or "dq.*"). Times are nanoseconds; an absent bound is not judged.
struct SpecEntry {
  std::string id;
  int line = 0;                // 1-based line in the file, for messages
  bool is_dds_thread = false;  // of `dds_threads`
  ThreadParameters parameters;
  std::optional<std::int64_t> response_deadline_ns;
  std::optional<std::int64_t> wcet_ns;
  std::optional<std::int64_t> min_inter_arrival_ns;
  std::optional<std::int64_t> max_inter_arrival_ns;
  std::optional<std::uint64_t> missed_releases_allowed;
  std::optional<std::uint64_t> overwrites_allowed;
  std::optional<std::int64_t> foreign_work_budget_ns;  // per second of the thread's span

  // "<node>/*": judges and configures every callback of that node that has no exact entry.
  bool is_wildcard() const noexcept;
  // "<node>" of "<node>/*" and of a callback's id.
  std::string_view node() const noexcept;
  friend bool operator==(const SpecEntry&, const SpecEntry&) = default;
};

// What a spec finds a callback by: its logical id, and a timer's period (0: none, or not known).
struct SpecCallback {
  // Implicit: most are known by an id alone. NOLINTNEXTLINE(google-explicit-constructor)
  SpecCallback(std::string logical_id, std::uint64_t period = 0)
      : id(std::move(logical_id)), period_ns(period) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  SpecCallback(const char* logical_id) : id(logical_id) {}

  std::string id;
  std::uint64_t period_ns = 0;
};

// A path of callbacks linked by messages, with the bounds it is meant to keep.
struct SpecChain {
  std::string name;
  int line = 0;
  std::vector<std::string> callbacks;  // logical ids, source first
  std::optional<std::int64_t> path_latency_ns;
  std::optional<std::int64_t> reaction_time_ns;
  std::optional<std::int64_t> data_age_ns;
};

// A spec file that cannot be used. what() names file, line, entry and the remedy.
class SpecError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An immutable, validated spec. Safe to read from several threads.
class SchedulingSpec {
 public:
  // Reads and validates a file. Throws SpecError; nothing is clamped, unknown keys are errors. With
  // a DDS domain, entries whose `domain_id` is another one are left out; without, entries of
  // several domains must ask the same of an id.
  static SchedulingSpec load(const std::filesystem::path& file,
                             std::optional<std::uint32_t> domain = std::nullopt);
  // The same over text; `name` stands in messages where the file's name would.
  static SchedulingSpec parse(std::string_view text, std::string_view name,
                              std::optional<std::uint32_t> domain = std::nullopt);

  // The entry for a callback: its exact id; else, for a timer with a name, that of its period, as
  // if it had none ("/node@Timer(100000000)" for "/node@Timer(tick)"); else the wildcard of its
  // node. Null if none.
  const SpecEntry* find_callback(std::string_view logical_id,
                                 std::uint64_t period_ns = 0) const noexcept;
  // The entry for a thread that is not a callback's, by its name; a whole name wins over "dq.*".
  // Null if none.
  const SpecEntry* find_thread(std::string_view name) const noexcept;

  const std::vector<SpecEntry>& callbacks() const noexcept { return callbacks_; }
  const std::vector<SpecEntry>& threads() const noexcept { return threads_; }
  const std::vector<SpecChain>& chains() const noexcept { return chains_; }
  // Pairs of `hardware_info` as written (lscpu's fields), in the file's order.
  const std::vector<std::pair<std::string, std::string>>& hardware_info() const noexcept {
    return hardware_info_;
  }
  // The line of each of them.
  const std::vector<int>& hardware_info_lines() const noexcept { return hardware_info_lines_; }
  // Sections of existing configurators that are about the machine rather than about the process's
  // threads (rt_throttling, kernel_threads, irqs), each with the line at which its content begins:
  // read over, not applied.
  const std::vector<std::pair<std::string, int>>& not_applied() const noexcept {
    return not_applied_;
  }
  const std::string& name() const noexcept { return name_; }      // file name, for messages
  const std::string& sha256() const noexcept { return sha256_; }  // of the bytes, lower-case hex

 private:
  std::string name_;
  std::string sha256_;
  std::vector<SpecEntry> callbacks_;
  std::vector<SpecEntry> threads_;
  std::vector<SpecChain> chains_;
  std::vector<std::pair<std::string, std::string>> hardware_info_;
  std::vector<int> hardware_info_lines_;
  std::vector<std::pair<std::string, int>> not_applied_;
  using Index = std::map<std::string, std::size_t, std::less<>>;  // into the vectors above
  Index callback_index_;                                          // exact ids
  Index nodes_;                                                   // nodes that have a wildcard
  std::map<std::string, std::map<std::uint64_t, std::size_t>, std::less<>>
      timers_;  // exact ids by node and period
  Index thread_index_;
  Index thread_families_;  // what stands before the star: "dq."
};

// Holds this machine against the spec's `hardware_info`: what lscpu reports in the C locale, its
// names in lower case with underscores ("Thread(s) per core": threads_per_core); numbers are
// compared as numbers, empty values not at all. Throws SpecError naming each field that differs,
// what was expected and what was found, or saying that lscpu cannot be run. Asks nothing if the
// spec has none.
void check_hardware_info(const SchedulingSpec& spec);
// The same against a text of lscpu.
void check_hardware_info(const SchedulingSpec& spec, std::string_view lscpu);

}  // namespace cie
