// Threads known by a small number.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/report_rows.hpp>

#include "output/kept_instance.hpp"

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace cie::viewer_export {

// A thread as viewers know it. Incarnations that followed one another under one tid share it.
struct ThreadKey {
  analysis::HostIndex host{};
  std::int64_t pid = 0;
  std::int64_t tid = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr): see time.hpp
  friend auto operator<=>(const ThreadKey&, const ThreadKey&) = default;
};

template <typename T>
ThreadKey thread_of(const T& told) {
  return {told.host, told.pid, told.tid};
}

// Of a row of the report.
inline ThreadKey thread_of(const analysis::ThreadReport& thread, const analysis::ReportRows& rows) {
  const auto& process = rows.process_of(thread);
  return {process.host_index, process.pid, thread.tid};
}

// "pid 1 tid 2"; "pid 1, threads not recorded".
inline std::string ids_of(const ThreadKey& thread) {
  return "pid " + std::to_string(thread.pid) +
         (known_tid(thread.tid) ? " tid " + std::to_string(thread.tid) : ", threads not recorded");
}

class ThreadTable {
 public:
  // The number of a thread; numbers are dense and given in order of first use.
  std::uint32_t number(const ThreadKey& thread) {
    auto& recent = recent_[static_cast<std::uint64_t>(thread.tid) % kRecent];
    if (recent.number == kNone || recent.thread != thread) {
      const auto [at, is_new] =
          numbers_.try_emplace(thread, static_cast<std::uint32_t>(threads_.size()));
      if (is_new) threads_.push_back(thread);
      recent = {thread, at->second};
    }
    return recent.number;
  }
  const ThreadKey& thread(std::uint32_t number) const { return threads_.at(number); }
  const std::vector<ThreadKey>& all() const noexcept { return threads_; }

 private:
  static constexpr std::size_t kRecent = 1024;
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Recent {
    ThreadKey thread;
    std::uint32_t number = kNone;
  };

  std::vector<ThreadKey> threads_;
  std::map<ThreadKey, std::uint32_t> numbers_;
  std::array<Recent, kRecent> recent_;  // by tid: the map is asked but once in a while
};

}  // namespace cie::viewer_export
