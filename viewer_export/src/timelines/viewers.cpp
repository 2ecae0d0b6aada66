#include "viewers.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/tracepoints/utf8.hpp>

#include <algorithm>
#include <array>

namespace cie::viewer_export {

ReportNames::ReportNames(const analysis::Report& report) {
  for (const auto& process : report.processes) {
    auto& [names, host] = processes_[{process.host_index, process.pid}];
    const auto name = valid_utf8(process.name);
    const bool is_told = name.empty() || names == name || names.ends_with(", then " + name);
    if (!is_told) names += (names.empty() ? "" : ", then ") + name;
    host = valid_utf8(process.host);
    programs_[process.index] = name;
    has_several_hosts_ |= process.host_index != report.processes.front().host_index;
  }
  const analysis::ReportRows rows(report);
  for (const auto& thread : report.threads)
    threads_[thread_of(thread, rows)] = valid_utf8(thread.name);
}

std::string ReportNames::process(analysis::HostIndex host, std::int64_t pid) const {
  const auto found = processes_.find({host, pid});
  return found == processes_.end() ? std::string() : found->second.name;
}

std::string ReportNames::process(analysis::ProcessIndex index) const {
  const auto found = programs_.find(index);
  return found == programs_.end() ? std::string() : found->second;
}

std::string ReportNames::host(analysis::HostIndex host, std::int64_t pid) const {
  const auto found = processes_.find({host, pid});
  return found == processes_.end() ? std::string() : found->second.host;
}

std::string ReportNames::thread(const ThreadKey& thread) const {
  const auto found = threads_.find(thread);
  return found == threads_.end() ? std::string() : found->second;
}

namespace {

struct Format {
  std::string_view name;
  std::unique_ptr<ViewerExport> (*make)(const ViewerOptions&);
};
constexpr std::array<Format, 4> kFormats{{{"chrome", make_chrome_export},
                                          {"speedscope", make_speedscope_export},
                                          {"otlp", make_otlp_export},
                                          {"mcap", make_mcap_export}}};

}  // namespace

std::vector<std::string_view> viewer_formats() {
  std::vector<std::string_view> names(kFormats.size());
  std::ranges::transform(kFormats, names.begin(), &Format::name);
  return names;
}

std::unique_ptr<ViewerExport> make_viewer_export(std::string_view format,
                                                 const ViewerOptions& options) {
  const auto* const found = std::ranges::find(kFormats, format, &Format::name);
  return found == kFormats.end() ? nullptr : found->make(options);
}

}  // namespace cie::viewer_export
