#include "discovery.hpp"

#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/recording_manifest.hpp>

#include "ctf/salvage/metadata_rebuild.hpp"

#include <algorithm>
#include <exception>
#include <string>
#include <system_error>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxTraces = 100'000;

// Of a recording that another machine received, this one has the manifest.
std::string why_there_is_none(const std::filesystem::path& directory) {
  try {
    const auto manifest = load_recording_manifest(directory);
    if (manifest && manifest->relay) {
      const auto& sessions = manifest->relay->sessions;
      return "it was streamed to " + manifest->relay->address +
             ": read it there, in the directory of cie collect" +
             (sessions.empty() ? "" : ", as " + sessions.front().path);
    }
  } catch (const std::exception&) {
    // A damaged manifest says nothing more than none.
  }
  return "no CTF trace in it (no file named \"metadata\"); was anything recorded?";
}

}  // namespace

void require_trace_directory(const std::filesystem::path& trace) {
  namespace fs = std::filesystem;
  const auto shown = trace.string();
  std::error_code error;
  const auto status = fs::status(trace, error);
  if (!fs::exists(status)) {
    throw UnreadableTrace("cannot read trace " + shown + ": " +
                          (error ? error.message() : "no such file or directory") +
                          "; name the directory that holds the trace");
  }
  if (!fs::is_directory(status)) {
    throw UnreadableTrace("cannot read trace " + shown +
                          ": not a directory; name the directory that holds the trace");
  }
}

std::vector<std::filesystem::path> find_traces(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  require_trace_directory(path);
  const auto shown = path.string();
  std::error_code error;
  std::vector<fs::path> found;
  const auto take = [&found](const fs::path& directory) {
    std::error_code ignored;
    const bool is_trace =
        fs::is_regular_file(directory / "metadata", ignored) || ctf::has_packets(directory);
    if (is_trace) found.push_back(directory);
  };
  take(path);
  fs::recursive_directory_iterator entry(path, error);
  if (error) throw UnreadableTrace("cannot read trace " + shown + ": " + error.message());
  fs::path last;  // which an error on the way to the next one is about
  for (const fs::recursive_directory_iterator end; entry != end; entry.increment(error)) {
    last = entry->path();
    if (entry.depth() >= kMaxDepth) entry.disable_recursion_pending();
    std::error_code ignored;
    if (entry->is_directory(ignored)) take(entry->path());
    if (found.size() > kMaxTraces) break;
  }
  if (error) {
    throw UnreadableTrace("cannot read trace " + shown + ": cannot list " + last.string() + ": " +
                          error.message());
  }
  if (found.empty()) {
    throw UnreadableTrace("cannot read trace " + shown + ": " + why_there_is_none(path));
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace cie::analysis
