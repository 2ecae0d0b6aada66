#include <cie/analysis/recorded_events.hpp>
#include <cie/tracepoints/nearest_name.hpp>
#include <cie/viewer_export/recorded_event_writer.hpp>

#include "base/messages.hpp"
#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "window_option.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>

namespace cie::cli {
namespace {

using viewer_export::EventFormat;

constexpr const char* kEventsDescription =
    "Prints the events of recordings themselves, of every class, in order of time; with --count how\n"
    "many there are of each class. Times are CLOCK_MONOTONIC in nanoseconds.";

constexpr const char* kEventsFooter =
    "Examples:\n"
    "  cie events run1 --count                        what was recorded, and how much of it\n"
    "  cie events run1 --name 'ros2:*_init'           who there is\n"
    "  cie events run1 --window +1s..+1010ms | less   what happened in those 10 ms\n"
    "  cie events run1 -f json | jq 'select(.tid == 4008)'\n"
    "\n"
    "Exit codes: 0 done, 2 wrong usage (a --name of no class of the recording is), 4 trace unreadable or result not writable.\n";

EventFormat format_of(const std::string& name) {
  check_choice("--format", name, {"text", "json", "csv"});
  if (name == "text") return EventFormat::text;
  return name == "json" ? EventFormat::json : EventFormat::csv;
}

// The names of classes that are wanted, and what became of them.
class NameChoice {
 public:
  explicit NameChoice(const std::vector<std::string>& globs)
      : globs_(globs), has_class_(globs.size(), false) {}

  bool wants(std::string_view name) {
    const auto& word = names_.emplace_back(name);
    bool is_wanted = globs_.empty();
    for (std::size_t i = 0; i < globs_.size(); ++i) {
      if (::fnmatch(globs_[i].c_str(), word.c_str(), 0) != 0) continue;
      has_class_[i] = true;
      is_wanted = true;
    }
    return is_wanted;
  }
  // Throws UsageError if no class of the recordings has one of the names.
  void check() const {
    for (std::size_t i = 0; i < globs_.size(); ++i) {
      if (has_class_[i]) continue;
      const auto likely = did_you_mean(globs_[i], names_);
      throw UsageError(fmt::format("--name: no class of events is called \"{}\"{}", globs_[i],
                                   likely.empty() ? kHint : likely));
    }
  }

 private:
  static constexpr std::string_view kHint = "; --count in place of --name lists what there is";

  const std::vector<std::string>& globs_;
  std::vector<bool> has_class_;  // by glob
  std::vector<std::string> names_;
};

// "3 events lost by the tracer, 1 place that cannot be read"; nothing if all is there.
std::string told(const analysis::MissingEvents& missing) {
  std::string text;
  const auto add = [&text](std::uint64_t count, std::string_view noun, std::string_view what) {
    if (count == 0) return;
    text += (text.empty() ? "" : ", ") + counted(count, noun) + std::string(what);
  };
  add(missing.events, "event", " lost by the tracer");
  add(missing.packets, "packet", " lost by the tracer");
  add(missing.damaged, "place", " that cannot be read");
  add(missing.foreign, "stream", " read with other metadata");
  add(missing.malformed, "class", " of events that cannot be understood");
  if (missing.malformed > 0) text += " (" + missing.why_malformed + ')';
  return text;
}

}  // namespace

int events_command(const Arguments& arguments) {
  std::vector<std::filesystem::path> traces;
  std::vector<std::string> globs;
  std::string target = "-";
  std::string format = "text";
  bool is_count = false;
  CommandLine line({"cie events TRACE... [OPTIONS]", kEventsDescription, kEventsFooter});
  line.traces(traces);
  line.flag("--count", is_count, "How many events there are of each class");
  line.option("--name", "GLOB", globs, "Only classes of that name, as 'ros2:*'; repeatable");
  const WindowOption window(line);
  line.option("-f,--format", "FORMAT", format, "text (default), json (an object per line) or csv");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  const ReaderOption reader(line);
  if (!line.parse(arguments)) return ok;
  const auto event_format = format_of(format);
  require_traces(traces);
  analysis::AnalysisOptions part{.metadata_from = reader.metadata()};
  window.resolve(traces, part);

  auto output = open_output(target);
  ProgressBar bar(reader.is_progress_wanted() && !output.is_terminal());
  NameChoice names(globs);
  const analysis::RecordedEventOptions options{
      .wants = [&names](std::string_view name) { return names.wants(name); },
      .has_fields = !is_count,
      .window = part.window,
      .metadata_from = reader.metadata(),
      .progress = bar.begin("reading", ProgressUnit::bytes)};
  analysis::MissingEvents missing;
  bool has_event = false;
  const auto write = [&](std::ostream& out) {
    const auto read_into = [&](const auto& use) {
      missing = analysis::read_recorded_events(traces, options, [&](const auto& event) {
        has_event = true;
        use(event);
      });
      bar.end();
      if (!has_event) window.check_empty(traces, part);
      names.check();
    };
    if (is_count) {
      viewer_export::EventCounter counter;
      read_into([&counter](const auto& event) { counter.add(event); });
      counter.write(out, event_format);
    } else {
      viewer_export::RecordedEventWriter writer(out, event_format);
      read_into([&writer](const auto& event) { writer.write(event); });
    }
  };
  write_data(output, write, event_format == viewer_export::EventFormat::csv);
  if (!has_event && !reader.is_quiet() && !globs.empty())
    tell(fmt::format("note: 0 events of {}", fmt::join(globs, ", ")));
  if (const auto text = told(missing); !reader.is_quiet() && !text.empty()) tell(text);
  return ok;
}

}  // namespace cie::cli
