#include "keeping/outcome.hpp"

#include "base/program.hpp"
#include "base/text.hpp"
#include "keeping/chunk_names.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

// The scheduling spec that a command names as this project's programs take it: `--spec FILE`.
// Empty: none.
fs::path spec_of(const std::vector<std::string>& command) {
  constexpr std::string_view kOption = "--spec";
  for (auto argument = command.begin(); argument != command.end(); ++argument) {
    fs::path file;
    if (*argument == kOption && std::next(argument) != command.end()) {
      file = *std::next(argument);
    } else if (argument->starts_with(std::string(kOption) + '=')) {
      file = argument->substr(kOption.size() + 1);
    }
    std::error_code ignored;
    const bool is_yaml = file.extension() == ".yaml" || file.extension() == ".yml";
    if (is_yaml && fs::is_regular_file(file, ignored)) return file;
  }
  return {};
}

// The commands that read a recording, for pasting: judged by the spec that its command ran by.
std::string next_commands(const Options& options) {
  const auto spec = spec_of(options.command);
  const auto input = shell_quoted(options.directory.string()) +
                     (spec.empty() ? "" : " --spec " + shell_quoted(spec.string()));
  return fmt::format("next: cie report {}\n      cie verify {}\n", input, input);
}

// " (user-space events; kernel events: no, …)".
std::string events_in_words(const RecordingManifest& manifest) {
  std::string kernel = "no";
  if (manifest.has_kernel_events) {
    kernel = fmt::format("{} by {}", manifest.kernel.events.value_or(0), manifest.kernel.route);
  } else if (!manifest.kernel_reason.empty()) {
    kernel += ", " + manifest.kernel_reason;
  }
  return " (user-space events; kernel events: " + kernel + ')';
}

std::string result(const Outcome& outcome, const KeptInDirectory& /*kept*/) {
  return fmt::format("recorded {}{}\n{}", shell_quoted(outcome.options.directory.string()),
                     events_in_words(outcome.manifest), next_commands(outcome.options));
}

std::string result(const Outcome& outcome, const KeptInChunks& kept) {
  const std::string removed = kept.removed > 0 ? fmt::format(", of which the oldest {} removed",
                                                             counted(kept.removed, "was", "were"))
                                               : "";
  return fmt::format("recorded {} in {}{}; each is a recording, too{}\n{}",
                     counted(kept.sealed, "chunk"),
                     shell_quoted(outcome.options.directory.string()), removed,
                     events_in_words(outcome.manifest), next_commands(outcome.options));
}

std::string result(const Outcome& outcome, const KeptInSnapshots& kept) {
  const fs::path& directory = outcome.options.directory;
  std::string text = fmt::format("saved {} in {}", counted(kept.saved, "snapshot"),
                                 shell_quoted(directory.string()));
  if (kept.left_out > 0) {
    text += fmt::format(
        "; {} more there was a reason to, but --max-snapshots or --min-interval forbade it",
        counted(kept.left_out, "time"));
  }
  if (kept.saved > 0) {
    text += kept.has_kernel_events ? " (user-space and kernel events)"
                                   : events_in_words(outcome.manifest);
  }
  text += '\n';
  if (kept.saved > 0) {
    text += fmt::format("next: cie report {}\n",
                        shell_quoted(snapshot_directory(directory, 1).string()));
  }
  return text;
}

std::string result(const Outcome& outcome, const KeptElsewhere& /*kept*/) {
  std::string text =
      "streamed to the relay daemon at " + outcome.options.relay.value_or(NetworkAddress{}).text();
  for (const RelayedSession& session : outcome.manifest.relay.value_or(RecordedRelay{}).sessions) {
    text += ", as " + session.path;
  }
  text += events_in_words(outcome.manifest);
  return text +
         fmt::format("\nnext, where it collects: cie report DIR; what was lost here stands in {}\n",
                     shell_quoted((outcome.options.directory / kManifestName).string()));
}

std::string losses(const RecordingManifest& manifest) {
  std::string text;
  for (const RecordedChannel& loss : manifest.channels) {
    if (loss.discarded_events > 0 || loss.lost_packets > 0) {
      text += fmt::format(
          "LOST: channel \"{}\" discarded {} and lost {}; record with a larger "
          "--subbuf-size or --num-subbuf\n",
          loss.name, counted(loss.discarded_events, "event"), counted(loss.lost_packets, "packet"));
    }
  }
  if (manifest.kernel.lost_events > 0) {
    text +=
        fmt::format("LOST: the kernel's buffers lost {}; record with a larger --kernel-buffer\n",
                    counted(manifest.kernel.lost_events, "event"));
  }
  if (manifest.kernel.untold_switches > 0) {
    // They are counted apart from what full buffers lost.
    const bool is_besides = manifest.kernel.lost_events > 0;
    text += fmt::format(
        "LOST: {}this kernel did not report {} of threads, {}: execution times around them are not "
        "measured\n",
        is_besides ? "besides, " : "", counted(manifest.kernel.untold_switches, "switch"),
        is_besides ? "where no buffer was full" : "though no buffer was full");
  }
  return text;
}

std::string failure(const Outcome& outcome) {
  const Options& options = outcome.options;
  const std::string where = options.relay ? "at " + options.relay->text()
                                          : "in " + shell_quoted(options.directory.string());
  std::string text = outcome.is_directory_there
                         ? "THE RECORDING FAILED; what there is stands " + where + ":\n"
                         : "THE RECORDING FAILED:\n";
  for (const std::string& problem : all_problems(outcome.manifest)) {
    text += fmt::format("  {}\n", problem);
  }
  return text;
}

}  // namespace

std::string summary(const Outcome& outcome) {
  const RecordingManifest& manifest = outcome.manifest;
  std::string text;
  if (manifest.exit) {
    text = fmt::format("{} {}\n", outcome.options.command.front(), describe(*manifest.exit));
  }
  text += losses(manifest);
  if (!outcome.is_success()) return text + failure(outcome);
  return text + std::visit([&](const auto& kept) { return result(outcome, kept); }, outcome.kept);
}

int exit_status(const Outcome& outcome) {
  constexpr int kKilled = 128;
  if (!outcome.is_success()) return kFailed;
  const auto& exit = outcome.manifest.exit;
  if (!outcome.options.preserves_status || !exit) return 0;
  return exit->signal ? kKilled + *exit->signal : exit->code.value_or(0);
}

}  // namespace cie::record
