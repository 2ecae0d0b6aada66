#include "deadline_groups.hpp"

#include "task_model.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::int64_t kAdmissiblePpb = 950'000'000;  // sched_rt_runtime_us / sched_rt_period_us

bool share_cpus(const DeadlineGroup& a, const DeadlineGroup& b) {
  return a.host == b.host && std::ranges::any_of(a.admission.cpus, [&b](std::uint32_t cpu) {
           return std::ranges::binary_search(b.admission.cpus, cpu);
         });
}

void join(DeadlineGroup& group, const DeadlineGroup& other) {
  group.threads.insert(group.threads.end(), other.threads.begin(), other.threads.end());
  std::vector<std::uint32_t> cpus;
  std::ranges::set_union(group.admission.cpus, other.admission.cpus, std::back_inserter(cpus));
  group.admission.cpus = std::move(cpus);
}

// Those that lived together at any time, which they do when one of them begins.
void judge(DeadlineGroup& group, const ReportRows& rows) {
  auto& admission = group.admission;
  admission.processors =
      static_cast<std::uint32_t>(std::max<std::size_t>(admission.cpus.size(), 1));
  admission.admissible_ppb = kAdmissiblePpb * static_cast<std::int64_t>(admission.processors);
  admission.is_guaranteed = true;
  admission.reserved_ppb = 0;
  for (const auto* beginning : group.threads) {
    const auto begin = rows.process_of(*beginning).lived.from;
    std::vector<DeadlineServer> servers;
    bool is_sound = true;
    for (const auto* thread : group.threads) {
      const auto& lived = rows.process_of(*thread).lived;
      if (begin < lived.from || begin > lived.to) continue;
      servers.push_back(server_of(*thread->sched));
      is_sound = is_sound && servers.back().period > 0 && !thread->sched->cpus.empty();
    }
    admission.servers = std::max(admission.servers, servers.size());
    admission.is_guaranteed = admission.is_guaranteed && is_sound &&
                              are_deadlines_guaranteed(servers, admission.processors);
    if (!is_sound) admission.reserved_ppb.reset();
    if (admission.reserved_ppb)
      admission.reserved_ppb = std::max(*admission.reserved_ppb, reserved_ppb(servers));
  }
}

}  // namespace

std::vector<DeadlineGroup> deadline_groups(const Report& report, const ReportRows& rows) {
  std::vector<DeadlineGroup> groups;
  for (const auto& thread : report.threads) {
    if (!thread.sched || !is_deadline(*thread.sched)) continue;
    const auto& process = rows.process_of(thread);
    DeadlineGroup group{.threads = {&thread}, .host = process.host_index};
    group.admission.cpus = thread.sched->cpus;
    std::ranges::sort(group.admission.cpus);
    if (report.trace.hosts.size() > 1) group.admission.host = process.host;
    std::erase_if(groups, [&group](const DeadlineGroup& other) {
      const bool is_joined = share_cpus(group, other);
      if (is_joined) join(group, other);
      return is_joined;
    });
    groups.push_back(std::move(group));
  }
  std::ranges::sort(groups, {}, [](const DeadlineGroup& group) {
    return std::pair(group.host, group.admission.cpus);
  });
  for (auto& group : groups)
    judge(group, rows);
  return groups;
}

}  // namespace cie::analysis
