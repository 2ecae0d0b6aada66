#include <cie/analysis/recorded_events.hpp>
#include <cie/tracepoints/nearest_name.hpp>
#include <cie/viewer_export/recorded_event_writer.hpp>

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
    "Exit codes: 0 done, 2 wrong usage, 4 trace unreadable or result not writable.\n";

EventFormat format_of(const std::string& name) {
  check_choice("--format", name, {"text", "json", "csv"});
  if (name == "text") return EventFormat::text;
  return name == "json" ? EventFormat::json : EventFormat::csv;
}

// The names of classes that are wanted, and what became of them.
class NameChoice {
 public:
  explicit NameChoice(const std::vector<std::string>& globs) : globs_(globs) {}

  bool wants(std::string_view name) {
    names_.emplace_back(name);
    const auto& word = names_.back();
    const bool is_wanted =
        globs_.empty() || std::ranges::any_of(globs_, [&word](const std::string& glob) {
          return ::fnmatch(glob.c_str(), word.c_str(), 0) == 0;
        });
    has_any_ = has_any_ || is_wanted;
    return is_wanted;
  }
  // Empty if some class was wanted.
  std::string complaint() const {
    if (has_any_ || globs_.empty()) return {};
    return fmt::format("no class of events is called \"{}\"{}", globs_.front(),
                       did_you_mean(globs_.front(), names_));
  }

 private:
  const std::vector<std::string>& globs_;
  std::vector<std::string> names_;
  bool has_any_ = false;
};

// "3 events lost by the tracer, 1 place that cannot be read"; nothing if all is there.
std::string told(const analysis::MissingEvents& missing) {
  std::string text;
  const auto add = [&text](std::uint64_t count, std::string_view noun, std::string_view what) {
    if (count == 0) return;
    text += (text.empty() ? "" : ", ") + viewer_export::counted(count, noun) + std::string(what);
  };
  add(missing.events, "event", " lost by the tracer");
  add(missing.packets, "packet", " lost by the tracer");
  add(missing.damaged, "place", " that cannot be read");
  add(missing.foreign, "stream", " read with other metadata");
  return text;
}

void complain(const std::string& text) {
  if (!text.empty()) fmt::print(stderr, "cie: {}\n", printable(text));
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
  write_data(output, [&](std::ostream& out) {
    bool has_event = false;
    const auto read_into = [&](const auto& use) {
      missing = analysis::read_recorded_events(traces, options, [&](const auto& event) {
        has_event = true;
        use(event);
      });
      bar.end();
      if (!has_event) window.check_empty(traces, part);
    };
    if (is_count) {
      viewer_export::EventCounter counter;
      read_into([&counter](const auto& event) { counter.add(event); });
      counter.write(out, event_format);
    } else {
      viewer_export::RecordedEventWriter writer(out, event_format);
      read_into([&writer](const auto& event) { writer.write(event); });
    }
  });
  complain(names.complaint());
  if (!reader.is_quiet()) complain(told(missing));
  return ok;
}

}  // namespace cie::cli
