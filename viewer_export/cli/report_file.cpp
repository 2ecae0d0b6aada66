#include "report_file.hpp"

#include <cie/analysis/analyzer.hpp>

#include "base/file.hpp"
#include "json/row_json.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <exception>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace cie::cli {
namespace {

using analysis::CallbackReport;
using analysis::Isolation;
using viewer_export::Json;

// Version 1 has all that is compared, under the same names.
constexpr std::array<std::string_view, 2> kSchemas{"cie.report/1", "cie.report/2"};

// `place`: in the report.
template <typename Row>
Row row_in(const Json& json, const std::string& place) {
  Row row;
  viewer_export::RowReader reader(json);
  viewer_export::read_within(place, [&] { fields(reader, row); });
  return row;
}

CallbackReport callback_in(const Json& json, std::size_t index) {
  auto callback = row_in<CallbackReport>(json, "callbacks[" + std::to_string(index) + ']');
  if (!json.contains("isolation")) {  // a report of before there was such a key
    callback.isolation = json.at("isolated").get<bool>() ? Isolation::isolated
                         : callback.threads.empty()      ? Isolation::never_ran
                                                         : Isolation::not_isolated;
  }
  return callback;
}

analysis::ComparedRecord record_in(const Json& report) {
  std::vector<analysis::TraceDefect> defects;
  for (const auto& defect : report.at("defects"))
    defects.push_back(row_in<analysis::TraceDefect>(defect, "defects"));
  return analysis::ComparedRecord::of(row_in<analysis::TraceSummary>(report.at("trace"), "trace"),
                                      defects, !report.at("callbacks").empty());
}

// A complete record has the end of each run that ended.
std::optional<bool> never_ends(const CallbackReport& callback, bool is_complete) {
  if (callback.incomplete == 0) return false;
  return is_complete ? std::optional(true) : std::nullopt;
}

bool has_several_hosts(const Json& report) {
  const auto& callbacks = report.at("callbacks");
  return !callbacks.empty() && callbacks.front().contains("host");
}

// As SampleCollector has them, of rows, which have a host where there are several.
class IsolationClaims {
 public:
  explicit IsolationClaims(const Json& report) : has_hosts_(has_several_hosts(report)) {
    for (const auto& process : report.at("processes"))
      executors_[name_of(process)] = process.value("executor", Json());
    for (const auto& callback : report.at("callbacks"))
      if (callback.value("isolation", Json()) == "not_isolated") sharing_.insert(name_of(callback));
    for (const auto& thread : report.at("threads")) {
      if (thread.value("role", Json()) != "callback") continue;
      for (const auto& id : thread.at("callbacks"))
        given_.emplace(name_of(thread), id);
    }
  }
  bool of(const Json& callback) const {
    const auto process = name_of(callback);
    const auto executor = executors_.find(process);
    if (executor == executors_.end() || executor->second.is_null())
      return !sharing_.contains(process);
    return executor->second == label(ExecutorKind::isolated) ||
           given_.contains({process, callback.at("logical_id")});
  }

 private:
  using Name = std::pair<Json, Json>;  // host and pid
  Name name_of(const Json& row) const {
    return {has_hosts_ ? row.value("host", Json()) : Json(), row.at("pid")};
  }

  bool has_hosts_;
  std::map<Name, Json> executors_;
  std::set<Name> sharing_;
  std::set<std::pair<Name, Json>> given_;
};

analysis::CallbackSample sample_of(const CallbackReport& callback, bool is_complete) {
  auto sample = analysis::CallbackSample::of(callback);
  sample.are_lives_told = false;
  sample.never_ends = never_ends(callback, is_complete);
  sample.response_time = analysis::OrderStatistics::of_response_time(callback);
  sample.start_latency = analysis::OrderStatistics::of_start_latency(callback);
  sample.duration = analysis::OrderStatistics::of(callback.duration);
  return sample;
}

// Messages of the JSON library begin with a number of their own: "[json.exception.parse_error.101] ".
std::string without_number(std::string_view message) {
  const auto end = message.find("] ");
  const bool has_number = message.starts_with("[json.exception.") && end != std::string_view::npos;
  return std::string(has_number ? message.substr(end + 2) : message);
}

}  // namespace

analysis::ComparedSide side_in_report(const std::filesystem::path& file) {
  const auto fail = [&file](const std::string& why) -> analysis::UnreadableTrace {
    return analysis::UnreadableTrace("\"" + file.string() +
                                     "\" is neither a recording nor a report: " + why +
                                     "; reports are written by cie report --format json");
  };
  std::string text;
  try {
    text = read_file(file);
  } catch (const std::system_error& error) {
    throw fail(std::string("it cannot be opened (") + error.what() + ')');
  }
  analysis::ComparedSide side;
  try {
    const auto report = Json::parse(text);
    const auto& schema = report.at("schema").get_ref<const std::string&>();
    if (std::ranges::find(kSchemas, schema) == kSchemas.end()) {
      throw std::runtime_error("its schema is neither cie.report/1 nor cie.report/2");
    }
    side.record = record_in(report);
    const IsolationClaims claims(report);
    analysis::SamplesById samples;
    std::size_t index = 0;
    for (const auto& callback : report.at("callbacks")) {
      auto sample = sample_of(callback_in(callback, index++), side.record.is_complete);
      sample.is_isolation_claimed = claims.of(callback);
      samples.add(std::move(sample));
    }
    side.callbacks = std::move(samples).take();
  } catch (const std::exception& error) {
    throw fail(without_number(error.what()));
  }
  return side;
}

}  // namespace cie::cli
