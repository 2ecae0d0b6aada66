// The rows of a report by their numbers.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/report.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

// Borrows the report, which stays as it is meanwhile.
class ReportRows {
 public:
  explicit ReportRows(const Report& report);

  // Null if the report has no such row.
  const ProcessReport* find(ProcessIndex index) const noexcept;
  const ThreadReport* find(ThreadIndex index) const noexcept;
  const CallbackReport* find(CallbackIndex index) const noexcept;
  // Whose a row is. The analyzer's reports have a row for the process of every other row; where one
  // made by hand has none, this one is empty.
  const ProcessReport& process(ProcessIndex index) const noexcept;
  template <typename Row>
  const ProcessReport& process_of(const Row& row) const noexcept {
    return process(row.process);
  }

 private:
  // By number: where the row stands, from 1; 0: nowhere.
  using Places = std::vector<std::size_t>;
  template <typename Rows>
  static Places places_of(const Rows& rows);
  template <typename Rows, typename Index>
  static auto find(const Rows& rows, const Places& places, Index index) noexcept -> const
      typename Rows::value_type*;

  const Report& report_;
  Places processes_;
  Places threads_;
  Places callbacks_;
};

// The part of the recording that the report is of, if one was asked for; empty: all of it.
std::optional<TimeWindow> asked_window(const TraceSummary& trace) noexcept;

// The host of a process; where a report made by hand has no row for it, this one is empty.
const HostReport& host_of(const Report& report, const ProcessReport& process) noexcept;

// "pid 4001", or "pid 4001, program 2" of several processes that had that pid (ProcessReport::program).
std::string pid_words(std::int64_t pid, std::uint32_t program);
std::string pid_words(const ProcessReport& process);

// What tells the second and later rows of one name in a process apart: " (lifetime 2)". Empty for the
// first, which has its plain name.
std::string ordinal(std::string_view what, std::uint32_t number);
std::string ordinal(const CallbackReport& callback);

// From when to when the callback lived, within its process.
TimeWindow life_of(const CallbackReport& callback, const ProcessReport& process) noexcept;

// Of all messages that callbacks took, how many came from publishers that were not recorded.
struct TakenMessages {
  std::uint64_t messages = 0;
  std::uint64_t unrecorded = 0;
};
// Empty: none did.
std::optional<TakenMessages> taken_unrecorded(const Report& report) noexcept;

// Whether the isolated executor is the process's only one, or one of its several. False where no
// executor told of itself.
bool is_isolated_executor_alone(const ProcessReport& process) noexcept;
bool has_isolated_executor(const ProcessReport& process) noexcept;

// What those of a callback's instances took at most whose release is not known. Empty: there are
// none, or one of them may have taken any time.
std::optional<std::int64_t> at_most_where_unknown(const CallbackReport& callback) noexcept;

// The longest of a callback's response times. A bound: an instance whose release is not known took
// that long or longer, or may have.
struct LongestResponse {
  std::int64_t ns = 0;
  bool is_bound = false;
};
// Empty: none of its instances has a response time or a lower bound of it.
std::optional<LongestResponse> longest_response(const CallbackReport& callback) noexcept;
// How many times its deadline that is, of a callback that missed it; 0 of others. By this callbacks
// are worse than others.
double times_deadline(const CallbackReport& callback) noexcept;

}  // namespace cie::analysis
