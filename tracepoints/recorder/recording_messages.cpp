// What a recording tells its user, on standard error.
#include "error.hpp"
#include "kernel_snapshots.hpp"
#include "recording.hpp"

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <string_view>

#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

std::string in_mib(std::uint64_t bytes) {
  return std::to_string((bytes + (1U << 20U) - 1) >> 20U) + " MiB";
}

std::string quoted(const fs::path& path) {
  std::string text = path.string();
  const bool is_plain = std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("/._-+=:,@").find(c) != std::string_view::npos;
  });
  if (is_plain && !text.empty()) {
    return text;
  }
  std::string result = "'";
  for (const char c : text) {
    result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return result + '\'';
}

}  // namespace

// Refuses what does not fit: LTTng would let the applications run untraced.
void Recording::state_snapshot_cost() const {
  const Options& options = manifest_.options;
  if (!options.snapshot) {
    return;
  }
  const SnapshotCost cost = snapshot_cost(options);
  if (cost.bytes > cost.free_bytes) {
    throw RecordError("keeping that in memory takes " + in_mib(cost.bytes) + ", and /dev/shm has " +
                      in_mib(cost.free_bytes) +
                      " left: ask for less with --snapshot, --event-rate or --subbuf-size");
  }
  std::fprintf(stderr, "keeping the last %.3g s in memory: %s per CPU, %s in all",
               std::chrono::duration<double>(options.snapshot->length).count(),
               in_mib(cost.bytes_per_cpu).c_str(), in_mib(cost.bytes).c_str());
  std::fprintf(stderr, ", enough for %.0f events per second on each CPU\n", cost.event_rate);
  if (options.kernel == KernelChoice::yes) {
    std::fprintf(stderr, "kernel events besides: up to %s per CPU\n",
                 in_mib(KernelSnapshots::most_bytes_per_cpu(options)).c_str());
  }
  std::fprintf(stderr, "to save them: cie record --save %s\n", quoted(options.directory).c_str());
}

void Recording::tell(const SavedSnapshot& snapshot) {
  const std::string line_end = shown_seconds_ >= 0 ? "\n" : "";
  const double held = std::chrono::duration<double>(snapshot.held).count();
  std::fprintf(stderr, "%ssaved %s: the last %.3f s (%s)\n", line_end.c_str(),
               quoted(snapshot.directory).c_str(), held, snapshot.reason.c_str());
  const double wanted = std::chrono::duration<double>(manifest_.options.snapshot->length).count();
  const double ran = std::chrono::duration<double>(Clock::now() - began_).count();
  if (held < wanted * 0.9 && held < ran * 0.9) {
    warn("the buffers are too small for " + std::to_string(wanted) +
         " s of this application's events: a larger --event-rate makes them larger");
  }
}

std::string Recording::kernel_in_words() const {
  if (manifest_.kernel) {
    return std::to_string(manifest_.kernel->events) + " by " + manifest_.kernel->route;
  }
  return manifest_.no_kernel_because.empty() ? "no" : "no, " + manifest_.no_kernel_because;
}

void Recording::print_summary() const {
  const fs::path& directory = manifest_.options.directory;
  std::ostringstream text;
  if (manifest_.exit) {
    text << manifest_.options.command.front() << ' ' << describe(*manifest_.exit) << '\n';
  }
  for (const ChannelLoss& loss : manifest_.losses) {
    if (loss.discarded_events > 0 || loss.lost_packets > 0) {
      text << "LOST: channel \"" << loss.name << "\" discarded " << loss.discarded_events
           << " events and lost " << loss.lost_packets
           << " packets; record with a larger --subbuf-size or --num-subbuf\n";
    }
  }
  if (manifest_.kernel && manifest_.kernel->lost_events > 0) {
    text << "LOST: the kernel's buffers lost " << manifest_.kernel->lost_events
         << " events; record with a larger --kernel-buffer\n";
  }
  if (manifest_.kernel && manifest_.kernel->untold_switches > 0) {
    text << "LOST: this kernel did not tell " << manifest_.kernel->untold_switches
         << " switches of threads, though no buffer was full: what ran then is unknown\n";
  }
  if (manifest_.problems.empty()) {
    text << result_in_words();
  } else {
    text << "THE RECORDING FAILED; what there is stands "
         << (manifest_.options.relay ? "at " + manifest_.options.relay->text()
                                     : "in " + quoted(directory))
         << ":\n";
    for (const std::string& entry : manifest_.problems) {
      text << "  " << entry << '\n';
    }
  }
  const std::string line_end = shown_seconds_ >= 0 ? "\n" : "";
  std::fputs((line_end + text.str()).c_str(), stderr);
}

std::string Recording::result_in_words() const {
  const fs::path& directory = manifest_.options.directory;
  if (rotation_) {
    std::string text =
        "recorded " + std::to_string(rotation_->sealed()) + " chunks in " + quoted(directory);
    if (rotation_->removed() > 0) {
      text += ", of which the oldest " + std::to_string(rotation_->removed()) + " were removed";
    }
    return text + "\nnext: cie report " + quoted(directory) +
           "   (or one chunk of it)\n      cie verify " + quoted(directory) + '\n';
  }
  if (manifest_.options.relay) {
    std::string text = "streamed to the relay daemon at " + manifest_.options.relay->text();
    for (const RelaySession& session : manifest_.relayed) {
      text += ", as " + host_name() + '/' + session.name + "-*";
    }
    return text + "\nnext, where it collects: cie report DIR; what was lost here stands in " +
           quoted(directory / "manifest.json") + '\n';
  }
  if (!manifest_.options.snapshot) {
    return "recorded " + quoted(directory) +
           " (user-space events; kernel events: " + kernel_in_words() + ")\nnext: cie report " +
           quoted(directory) + "\n      cie verify " + quoted(directory) + '\n';
  }
  std::string text = "saved " + std::to_string(snapshots_) + " snapshots in " + quoted(directory);
  if (left_out_ > 0) {
    text += "; " + std::to_string(left_out_) +
            " times more there was a reason to, but --max-snapshots or --min-interval forbade it";
  }
  text += '\n';
  if (snapshots_ > 0) {
    text += "next: cie report " + quoted(directory / "snapshot-001") + '\n';
  }
  return text;
}

void Recording::show_progress() {
  if (isatty(STDERR_FILENO) == 0) {
    return;
  }
  const auto elapsed = std::chrono::duration_cast<seconds>(Clock::now() - began_).count();
  if (elapsed != shown_seconds_) {
    shown_seconds_ = elapsed;
    std::fprintf(stderr, "\rrecording %lld s, traced processes: %zu%s",
                 static_cast<long long>(elapsed), manifest_.processes.size(),
                 manifest_.options.is_attach() ? ", Ctrl-C ends it" : "");
  }
}

void Recording::warn(const std::string& text) {
  const char* line_end = shown_seconds_ >= 0 ? "\n" : "";
  std::fprintf(stderr, "%scie record: warning: %s\n", line_end, text.c_str());
}

void Recording::problem(const std::string& text) { manifest_.problems.push_back(text); }

}  // namespace cie::record
