#include "viewers.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/tracepoints/utf8.hpp>

namespace cie::viewer_export {

ReportNames::ReportNames(const analysis::Report& report) {
  for (const auto& process : report.processes) {
    processes_[{process.host_index, process.pid}] = {valid_utf8(process.name),
                                                     valid_utf8(process.host)};
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

std::string ReportNames::host(analysis::HostIndex host, std::int64_t pid) const {
  const auto found = processes_.find({host, pid});
  return found == processes_.end() ? std::string() : found->second.host;
}

std::string ReportNames::thread(const ThreadKey& thread) const {
  const auto found = threads_.find(thread);
  return found == threads_.end() ? std::string() : found->second;
}

const std::vector<std::string_view>& viewer_formats() {
  static const std::vector<std::string_view> formats{"chrome", "speedscope", "otlp", "mcap"};
  return formats;
}

std::unique_ptr<ViewerExport> make_viewer_export(std::string_view format,
                                                 const ViewerOptions& options) {
  if (format == "chrome") return make_chrome_export(options);
  if (format == "speedscope") return make_speedscope_export(options);
  if (format == "otlp") return make_otlp_export(options);
  if (format == "mcap") return make_mcap_export(options);
  return nullptr;
}

}  // namespace cie::viewer_export
