#include "deadline_groups.hpp"

#include "task_model.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::int64_t kAdmissiblePpb = 950'000'000;  // sched_rt_runtime_us / sched_rt_period_us

using Cpus = std::vector<std::uint32_t>;
using Threads = std::vector<const ThreadReport*>;

Cpus cpus_of(const ThreadReport& thread) {
  auto cpus = thread.sched->cpus;
  std::ranges::sort(cpus);
  return cpus;
}

bool have_common(const Cpus& a, const Cpus& b) {
  return std::ranges::any_of(
      a, [&b](std::uint32_t cpu) { return std::ranges::binary_search(b, cpu); });
}

struct Sharing {
  Threads threads;
  Cpus cpus;  // of any of them, ascending
};

// Those that share CPUs, directly or by others.
std::vector<Sharing> sharing(const Threads& threads) {
  std::vector<Sharing> all;
  for (const auto* thread : threads) {
    Sharing joined{.threads = {thread}, .cpus = cpus_of(*thread)};
    std::erase_if(all, [&joined](const Sharing& other) {
      if (!have_common(joined.cpus, other.cpus)) return false;
      joined.threads.insert(joined.threads.end(), other.threads.begin(), other.threads.end());
      Cpus cpus;
      std::ranges::set_union(joined.cpus, other.cpus, std::back_inserter(cpus));
      joined.cpus = std::move(cpus);
      return true;
    });
    all.push_back(std::move(joined));
  }
  return all;
}

std::vector<DeadlineServer> servers_of(const Threads& threads) {
  std::vector<DeadlineServer> servers;
  for (const auto* thread : threads)
    servers.push_back(server_of(*thread->sched));
  return servers;
}

// The tests are of threads that may use all of the CPUs. Of sets that differ, it is enough that each CPU
// alone would do for all that may use it.
bool are_guaranteed(const Sharing& group, std::int64_t effort) {
  const bool is_one_set = std::ranges::all_of(group.threads, [&group](const ThreadReport* thread) {
    return cpus_of(*thread) == group.cpus;
  });
  if (is_one_set) {
    return are_deadlines_guaranteed(servers_of(group.threads),
                                    static_cast<std::uint32_t>(group.cpus.size()), effort);
  }
  effort /= std::ssize(group.cpus);
  return std::ranges::all_of(group.cpus, [&group, effort](std::uint32_t cpu) {
    Threads here;
    std::ranges::copy_if(
        group.threads, std::back_inserter(here), [cpu](const ThreadReport* thread) {
          return std::ranges::find(thread->sched->cpus, cpu) != thread->sched->cpus.end();
        });
    return are_deadlines_guaranteed(servers_of(here), 1, effort);
  });
}

// Those that live together at any time, which they do when one of them begins. Of these times each
// is given the same part of the effort.
void judge(DeadlineGroup& group, const ReportRows& rows, std::int64_t effort) {
  auto& admission = group.admission;
  admission.processors = static_cast<std::uint32_t>(admission.cpus.size());
  admission.admissible_ppb = kAdmissiblePpb * static_cast<std::int64_t>(admission.processors);
  admission.reserved_ppb = 0;
  std::set<Timestamp> begins;
  for (const auto& [thread, unused] : group.threads)
    begins.insert(rows.process_of(*thread).lived.from);
  effort /= std::ssize(begins);
  for (const auto begin : begins) {
    Threads alive;
    for (const auto& [thread, is_guaranteed] : group.threads) {
      if (overlap(rows.process_of(*thread).lived, {.from = begin, .to = begin}))
        alive.push_back(thread);
    }
    admission.servers = std::max(admission.servers, alive.size());
    const auto servers = servers_of(alive);
    const bool have_periods = std::ranges::all_of(
        servers, [](const DeadlineServer& server) { return server.period > 0; });
    if (!have_periods) admission.reserved_ppb.reset();
    if (admission.reserved_ppb)
      admission.reserved_ppb = std::max(*admission.reserved_ppb, reserved_ppb(servers));
    for (const auto& together : sharing(alive)) {
      if (are_guaranteed(together, effort)) continue;
      for (const auto* thread : together.threads)
        group.threads.at(thread) = false;
    }
  }
  if (!admission.unknown.empty()) return;
  admission.is_guaranteed =
      std::ranges::all_of(group.threads, [](const auto& thread) { return thread.second; });
}

// A thread that runs callbacks and may have been SCHED_DEADLINE with other parameters than are known.
std::string unknown_on(const Report& report, const ReportRows& rows, HostIndex host) {
  for (const auto& thread : report.threads) {
    const bool is_concerned = rows.process_of(thread).host_index == host &&
                              !thread.callbacks.empty() &&
                              (!thread.sched || is_deadline(*thread.sched) ||
                               std::ranges::any_of(thread.former, is_deadline));
    if (!is_concerned) continue;
    if (auto unknown = unknown_parameters(thread); !unknown.empty()) return unknown;
  }
  return {};
}

}  // namespace

std::vector<DeadlineGroup> deadline_groups(const Report& report, const ReportRows& rows) {
  std::map<HostIndex, Threads> hosts;
  for (const auto& thread : report.threads) {
    if (thread.sched && is_deadline(*thread.sched))
      hosts[rows.process_of(thread).host_index].push_back(&thread);
  }
  std::vector<DeadlineGroup> groups;
  for (const auto& [host, threads] : hosts) {
    auto of_host = sharing(threads);
    std::ranges::sort(of_host, {}, &Sharing::cpus);
    const auto unknown = unknown_on(report, rows, host);
    for (const auto& shared : of_host) {
      auto& group = groups.emplace_back();
      group.host = host;
      for (const auto* thread : shared.threads)
        group.threads.emplace(thread, true);
      group.admission.cpus = shared.cpus;
      group.admission.unknown = unknown;
      if (report.trace.hosts.size() > 1)
        group.admission.host = rows.process_of(*shared.threads.front()).host;
      judge(group, rows, kMaxEffort / std::ssize(of_host));
    }
  }
  return groups;
}

}  // namespace cie::analysis
