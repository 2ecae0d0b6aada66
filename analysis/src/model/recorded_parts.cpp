#include "recorded_parts.hpp"

#include "base/paths.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

namespace cie::analysis {
namespace {

// Chunks that lie in one directory, by their numbers.
using Chunks = std::map<std::uint64_t, const Recording*>;

std::string without_slash(const std::string& name) {
  const std::filesystem::path path(name);
  return path.has_filename() ? name : path.parent_path().string();
}

std::string parent_of(const std::string& name) {
  return std::filesystem::path(without_slash(name)).parent_path().string();
}

std::map<std::string, Chunks> chunks_of(const Model& model) {
  std::map<std::string, Chunks> chunks;
  for (const auto& recording : model.recordings) {
    if (!recording.manifest || !recording.manifest->chunk) continue;
    chunks[parent_of(recording.name)][*recording.manifest->chunk] = &recording;
  }
  return chunks;
}

bool is_host_of(const RecordingManifest& manifest, const HostFacts& host) {
  return host.told == manifest.host ||
         (!manifest.boot_id.empty() && host.clock_uuid == manifest.boot_id);
}

// Whose streams tell of another host than its recorder does is known by its processes.
bool is_host_known(const Model& model, const RecordingManifest& manifest) {
  return std::ranges::any_of(
      model.hosts, [&manifest](const HostFacts& host) { return is_host_of(manifest, host); });
}

bool is_seen(const Model& model, const RecordingManifest& manifest,
             const RecordedProcess& recorded) {
  const bool is_known = is_host_known(model, manifest);
  return std::ranges::any_of(model.processes, [&](const ProcessFacts& process) {
    const bool is_other_host = is_known && !is_host_of(manifest, model.hosts[at(process.host)]);
    const bool is_other_start =
        process.start_ns && recorded.start_ns && *process.start_ns != *recorded.start_ns;
    return process.pid == recorded.pid && !is_other_host && !is_other_start;
  });
}

bool has_kernel_events(const Model& model) {
  return std::ranges::any_of(model.streams, [](const StreamFacts& stream) {
    return stream.domain == Domain::kernel && stream.packets > 0;
  });
}

std::string in_recording(const Recording& recording) {
  return recording.name.empty() ? std::string() : " (" + recording.name + ')';
}

void add_unseen_processes(const Model& model, std::vector<UnseenPart>& parts) {
  std::map<std::pair<std::int64_t, std::string>, UnseenPart> unseen;  // each is told once
  for (const auto& recording : model.recordings) {
    if (!recording.manifest) continue;
    for (const auto& process : recording.manifest->processes) {
      if (is_seen(model, *recording.manifest, process)) continue;
      const auto name = process.name.empty() ? std::string() : process.name + ' ';
      const auto start = process.start_ns ? std::to_string(*process.start_ns) : std::string();
      unseen.try_emplace({process.pid, start},
                         UnseenPart{.kind = PartKind::process,
                                    .note = "process " + name + '(' + std::to_string(process.pid) +
                                            ") was recorded, and nothing is here of it" +
                                            in_recording(recording)});
    }
  }
  for (auto& [process, part] : unseen)
    parts.push_back(std::move(part));
}

void add_unseen_chunks(const Model& model, std::vector<UnseenPart>& parts) {
  for (const auto& recording : model.recordings) {
    for (const auto& chunk : recording.missing_chunks) {
      parts.push_back({.kind = PartKind::chunk,
                       .note = chunk + " was recorded, and is not here" + in_recording(recording)});
    }
  }
  // Where nothing says how many there were, those between others were recorded.
  for (const auto& [parent, chunks] : chunks_of(model)) {
    const bool is_whole_known =
        std::ranges::any_of(model.recordings, [&parent = parent](const Recording& whole) {
          return whole.manifest && !whole.manifest->chunk && !whole.manifest->files.empty() &&
                 without_slash(whole.name) == parent;
        });
    if (is_whole_known) continue;
    auto before = chunks.begin()->first;
    for (const auto& [number, recording] : chunks) {
      if (number > before + 1) {
        const bool is_one = number == before + 2;
        parts.push_back({.kind = PartKind::chunk,
                         .note = (is_one ? "chunk " : "chunks ") + std::to_string(before + 1) +
                                 (is_one ? "" : " to " + std::to_string(number - 1)) +
                                 (is_one ? " was" : " were") +
                                 " recorded, and nothing is here of " + (is_one ? "it" : "them") +
                                 " (" + parent + ')'});
      }
      before = number;
    }
  }
}

RecordingReport report_of(const Recording& recording) {
  const auto& manifest = *recording.manifest;
  RecordingReport report{.path = recording.name,
                         .host = manifest.host,
                         .command = manifest.command,
                         .exit = manifest.exit,
                         .has_kernel_events = manifest.has_kernel_events,
                         .first_chunk = std::nullopt,
                         .begin = manifest.begin,
                         .end = manifest.end,
                         .problems = all_problems(manifest)};
  return report;
}

// The whole's problems name those of its chunks.
bool is_told(const std::vector<std::string>& problems, const std::string& problem) {
  return std::ranges::any_of(problems, [&problem](const std::string& told) {
    return told.find(problem) != std::string::npos;
  });
}

void add_chunks(const Chunks& chunks, RecordingReport& report) {
  const auto& [number, first] = *chunks.begin();
  report.first_chunk = number;
  report.begin = first->manifest->begin;
  report.end = chunks.rbegin()->second->manifest->end;
  for (const auto& [unused, chunk] : chunks) {
    for (const auto& problem : all_problems(*chunk->manifest)) {
      if (!is_told(report.problems, problem)) report.problems.push_back(problem);
    }
  }
}

}  // namespace

std::string_view label(PartKind kind) noexcept {
  switch (kind) {
    case PartKind::process:
      return "process";
    case PartKind::chunk:
      return "chunk";
    case PartKind::kernel:
      break;
  }
  return "kernel";
}

std::vector<UnseenPart> unseen_parts(const Model& model) {
  std::vector<UnseenPart> parts;
  add_unseen_processes(model, parts);
  add_unseen_chunks(model, parts);
  const bool is_any_seen = has_kernel_events(model);
  for (const auto& recording : model.recordings) {
    const bool is_promised = recording.manifest && recording.manifest->has_kernel_events &&
                             recording.manifest->kernel.events != 0;
    if (!is_promised || (is_any_seen && !recording.is_kernel_missing)) continue;
    parts.push_back({.kind = PartKind::kernel,
                     .note = "events of the kernel were recorded, and nothing is here of them" +
                             in_recording(recording)});
  }
  return parts;
}

std::optional<std::string> missing_user_part(const Model& model) {
  for (const auto& recording : model.recordings) {
    for (const auto& doubt : recording.doubts) {
      if (doubt.costs_user_events) return doubt.note;
    }
  }
  for (const auto& part : unseen_parts(model)) {
    if (part.kind != PartKind::kernel) return part.note;
  }
  return std::nullopt;
}

std::vector<RecorderFailure> recorder_failures(const Model& model) {
  std::vector<RecorderFailure> failures;
  std::vector<std::string> told;
  for (const auto& recording : model.recordings) {
    RecorderFailure failure{.recording = &recording, .problems = {}};
    const auto add = [&](const std::string& problem) {
      if (is_told(failure.problems, problem)) return;
      const bool is_of_chunk = recording.manifest && recording.manifest->chunk;
      if (is_of_chunk && is_told(told, problem)) return;
      failure.problems.push_back(problem);
    };
    if (recording.is_unfinished)
      add("it goes on, its recorder was killed, or its directory was moved");
    if (recording.manifest) std::ranges::for_each(recording.manifest->problems, add);
    if (failure.problems.empty()) continue;
    told.insert(told.end(), failure.problems.begin(), failure.problems.end());
    failures.push_back(std::move(failure));
  }
  return failures;
}

std::string in_words(const RecorderFailure& failure, const std::string& problem) {
  return (failure.recording->is_unfinished ? "the recording is not finished: "
                                           : "cie record says: ") +
         problem + in_recording(*failure.recording);
}

bool names_all_processes(const Recording& recording) noexcept {
  return recording.manifest && recording.manifest->names_all_processes;
}

bool may_be_of(const Model& model, const Recording& recording, const ProcessFacts& process) {
  return !recording.manifest || !is_host_known(model, *recording.manifest) ||
         is_host_of(*recording.manifest, model.hosts[at(process.host)]);
}

std::int64_t recorded_offset_ns(const Model& model, const ProcessFacts& process) {
  for (const auto& recording : model.recordings) {
    if (!recording.manifest || !may_be_of(model, recording, process)) continue;
    for (const auto& recorded : recording.manifest->processes) {
      if (recorded.pid == process.pid && recorded.monotonic_offset_ns)
        return *recorded.monotonic_offset_ns;
    }
  }
  return 0;
}

std::optional<std::string> missing_kernel_part(const Model& model) {
  for (const auto& part : unseen_parts(model)) {
    if (part.kind == PartKind::kernel) return part.note;
  }
  return std::nullopt;
}

std::vector<const Recording*> recordings_around(std::span<const Recording> recordings,
                                                const std::string& file) {
  const auto place = [](const std::string& name) {
    std::error_code error;
    return std::filesystem::absolute(without_slash(name), error).lexically_normal();
  };
  const auto place_of_file = place(file);
  std::vector<const Recording*> around;
  for (const auto& recording : recordings) {
    if (is_below(place_of_file, place(recording.name))) around.push_back(&recording);
  }
  return around;
}

bool begins_late(const RecordingReport& recording) noexcept {
  return recording.first_chunk && *recording.first_chunk > 1;
}

std::vector<RecordingReport> recording_reports(const Model& model) {
  std::vector<RecordingReport> reports;
  auto chunks = chunks_of(model);
  for (const auto& recording : model.recordings) {
    if (!recording.manifest || recording.manifest->chunk) continue;
    auto report = report_of(recording);
    const auto parts = chunks.extract(without_slash(recording.name));
    if (!parts.empty()) add_chunks(parts.mapped(), report);
    reports.push_back(std::move(report));
  }
  for (const auto& [parent, parts] : chunks) {
    const auto& last = *parts.rbegin()->second;
    auto report = report_of(last);  // it knows how the command ended, if that was over
    report.problems.clear();
    if (parts.size() > 1) report.path = parent;
    add_chunks(parts, report);
    reports.push_back(std::move(report));
  }
  std::ranges::stable_sort(reports, {}, &RecordingReport::path);
  return reports;
}

}  // namespace cie::analysis
