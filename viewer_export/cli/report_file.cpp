#include "report_file.hpp"

#include <cie/analysis/analyzer.hpp>

#include <fstream>
#include <string>

#include <nlohmann/json.hpp>

namespace cie::cli {
namespace {

using Json = nlohmann::json;

analysis::OrderStatistics order_statistics(const Json& summary) {
  if (summary.is_null()) return {};
  analysis::Summary s;
  s.count = summary.at("count").get<std::uint64_t>();
  s.min = summary.at("min").get<std::int64_t>();
  s.max = summary.at("max").get<std::int64_t>();
  s.p50 = summary.at("p50").get<std::int64_t>();
  s.p90 = summary.at("p90").get<std::int64_t>();
  s.p99 = summary.at("p99").get<std::int64_t>();
  s.p99_9 = summary.at("p99_9").get<std::int64_t>();
  return analysis::OrderStatistics::of(s);
}

analysis::CallbackSample sample_of(const Json& callback) {
  analysis::CallbackSample sample;
  sample.logical_id = callback.at("logical_id").get<std::string>();
  sample.instances = callback.at("instances").get<std::uint64_t>();
  if (const auto& missed = callback.at("missed_releases"); !missed.is_null()) {
    sample.missed_releases = missed.get<std::uint64_t>();
  }
  sample.isolated = callback.at("isolated").get<bool>();
  sample.response_time = order_statistics(callback.at("response_time_ns"));
  sample.start_latency = order_statistics(callback.at("start_latency_ns"));
  sample.duration = order_statistics(callback.at("duration_ns"));
  return sample;
}

}  // namespace

std::vector<analysis::CallbackSample> samples_in_report(const std::filesystem::path& file) {
  const auto fail = [&file](const std::string& why) -> analysis::UnreadableTrace {
    return analysis::UnreadableTrace("\"" + file.string() +
                                     "\" is neither a recording nor a report: " + why +
                                     "; reports are written by cie report --format json");
  };
  std::ifstream stream(file);
  if (!stream) throw fail("it cannot be opened");
  try {
    const auto report = Json::parse(stream);
    if (report.at("schema") != "cie.report/1") throw fail("its schema is not cie.report/1");
    std::vector<analysis::CallbackSample> samples;
    for (const auto& callback : report.at("callbacks"))
      samples.push_back(sample_of(callback));
    return samples;
  } catch (const Json::exception& error) {
    throw fail(error.what());
  }
}

}  // namespace cie::cli
