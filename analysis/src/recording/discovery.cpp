#include "discovery.hpp"

#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/recording_manifest.hpp>

#include "base/paths.hpp"
#include "ctf/salvage/metadata_rebuild.hpp"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <set>
#include <string>

namespace cie::analysis {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxTraces = 100'000;
// A link may lead to a place that has nothing to do with the recording.
constexpr std::size_t kMaxBehindLinks = 10'000;

// What one walk through directories has seen.
class Walk {
 public:
  explicit Walk(Directories& directories) : directories_(directories) {}

  // Real directories before those that links lead to, so that each has its own name.
  void run(const fs::path& path) {
    std::error_code error;
    enter(fs::canonical(path, error), path, 0);
    real_ = known_.size();
    for (std::size_t next = 0; next < links_.size() && !directories_.error; ++next) {
      const auto link = links_[next];
      const auto target = fs::canonical(link.path, error);
      if (error) continue;  // gone meanwhile
      const auto place = fs::canonical(link.path.parent_path(), error);
      if (error || target == place || is_below(place, target)) continue;
      enter(target, link.path, link.depth);
      if (known_.size() - real_ > kMaxBehindLinks)
        fail(link.path, std::make_error_code(std::errc::too_many_symbolic_link_levels));
    }
  }

 private:
  struct Link {
    fs::path path;
    int depth;
  };

  void fail(const fs::path& path, const std::error_code& error) {
    if (directories_.error) return;
    directories_.error = error;
    directories_.failed = path;
  }
  bool is_full() const {
    const bool is_far = real_ != 0 && known_.size() - real_ > kMaxBehindLinks;
    return is_far || directories_.error || known_.size() > kMaxDirectories;
  }
  // `depth`: of what lies in it.
  void enter(const fs::path& canonical, const fs::path& path, int depth) {
    if (!known_.insert(canonical).second) return;
    directories_.found.push_back(path);
    if (depth > kMaxDepth) return;
    std::error_code error;
    fs::directory_iterator entry(path, error);
    std::vector<fs::path> below;
    for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
      std::error_code ignored;
      if (!entry->is_directory(ignored)) continue;
      if (entry->is_symlink(ignored)) {
        links_.push_back({entry->path(), depth + 1});
      } else {
        below.push_back(entry->path());
      }
    }
    if (error) fail(path, error);
    for (const auto& directory : below) {
      if (is_full()) return;
      enter(canonical / directory.filename(), directory, depth + 1);
    }
  }

  static constexpr std::size_t kMaxDirectories = 1'000'000;

  Directories& directories_;
  std::set<fs::path> known_;  // canonical
  std::size_t real_ = 0;      // of them, before the first link was followed
  std::vector<Link> links_;
};

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

Directories directories_in(const fs::path& path) {
  Directories directories;
  Walk(directories).run(path);
  return directories;
}

void require_trace_directory(const std::filesystem::path& trace) {
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
  require_trace_directory(path);
  const auto shown = path.string();
  std::vector<fs::path> found;
  const auto directories = directories_in(path);
  if (directories.error) {
    const bool is_itself = directories.failed == path;
    throw UnreadableTrace("cannot read trace " + shown + ": " +
                          (is_itself ? "" : "cannot list " + directories.failed.string() + ": ") +
                          directories.error.message());
  }
  for (const auto& directory : directories.found) {
    std::error_code ignored;
    const bool is_trace =
        fs::is_regular_file(directory / kMetadataName, ignored) || ctf::has_packets(directory);
    if (is_trace) found.push_back(directory);
    if (found.size() > kMaxTraces) break;
  }
  if (found.empty()) {
    throw UnreadableTrace("cannot read trace " + shown + ": " + why_there_is_none(path));
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace cie::analysis
