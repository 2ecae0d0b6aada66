#include <cie/scheduling/threads.hpp>
#include <cie/tracepoints/logical_id.hpp>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <string_view>

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

namespace cie::scheduling {

std::set<std::uint32_t> thread_ids() {
  std::set<std::uint32_t> tids;
  std::error_code error;
  for (std::filesystem::directory_iterator entry{"/proc/self/task", error}, end;
       !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename();
    std::uint32_t tid = 0;
    if (std::from_chars(name.data(), name.data() + name.size(), tid).ec == std::errc{}) {
      tids.insert(tid);
    }
  }
  return tids;
}

std::string thread_name(std::uint32_t tid) {
  std::ifstream file{fmt::format("/proc/self/task/{}/comm", tid)};
  std::string name;
  std::getline(file, name);
  return name;
}

namespace {

std::string_view last_part(std::string_view name) noexcept {
  return name.substr(name.rfind('/') + 1);  // npos + 1 is 0: a name without slash is its last part
}

// "100ms": the largest unit that the period is a whole number of.
std::string short_period(std::uint64_t ns) {
  constexpr std::uint64_t kThousand = 1000;
  if (ns % (kThousand * kThousand) == 0) return fmt::format("{}ms", ns / kThousand / kThousand);
  if (ns % kThousand == 0) return fmt::format("{}us", ns / kThousand);
  return fmt::format("{}ns", ns);
}

// "DeadlineMissed" of "/lidar@RequestedDeadlineMissed(/scan)"; the name of a plain waitable.
std::string_view event_or_name(const trace::CallbackInfo& info) {
  std::string_view kind = LogicalId::kind_of(info.logical_id);
  if (kind == "Waitable") return info.source;
  for (const std::string_view whose : {"Requested", "Offered", "Subscription", "Publication"}) {
    if (kind.starts_with(whose)) kind.remove_prefix(whose.size());
  }
  return kind;
}

}  // namespace

std::uint32_t current_tid() noexcept { return static_cast<std::uint32_t>(gettid()); }

ThreadsId new_threads_id() noexcept {
  static std::atomic<std::uint64_t> given{0};
  return ThreadsId{given.fetch_add(1, std::memory_order_relaxed)};
}

ThreadsId id_of_current_thread() noexcept {
  thread_local const ThreadsId id = new_threads_id();
  return id;
}

std::string thread_label(const trace::CallbackInfo& info) {
  constexpr std::size_t kRoom = kMostThreadName;
  std::string node{last_part(LogicalId::node_of(info.logical_id))};
  std::string source = info.kind == CallbackKind::timer
                           ? (info.period_ns == 0 ? "once" : short_period(info.period_ns))
                       : info.kind == CallbackKind::waitable
                           ? std::string{event_or_name(info)}
                           : info.source.substr(info.source.starts_with('/') ? 1 : 0);
  const std::size_t source_room = std::max(kRoom / 2, kRoom - 1 - std::min(node.size(), kRoom - 1));
  source.resize(std::min(source.size(), source_room));
  node.resize(std::min(node.size(), kRoom - 1 - source.size()));
  return node + ":" + source;
}

void set_current_thread_name(const std::string& name) noexcept {
  pthread_setname_np(pthread_self(), name.substr(0, kMostThreadName).c_str());
}

}  // namespace cie::scheduling
