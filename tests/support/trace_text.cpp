#include "support/trace_text.hpp"

#include "support/trace_writer.hpp"

#include <algorithm>

namespace cie::test {
namespace text {

TextTrace Writer::write(std::string_view text) {
  trace_.strings = std::make_shared<std::deque<std::string>>();
  trace_.cpus = std::make_shared<std::deque<std::vector<std::uint32_t>>>();
  std::vector<TimedLine> lines;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    auto content = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    content = content.substr(0, content.find('#'));
    const auto line = cut(content);
    if (line.words.empty() || declare(line)) continue;
    lines.emplace_back(line.parse(line.word(0)), line);
  }
  process();
  std::stable_sort(lines.begin(), lines.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  prologue();
  for (const auto& name : thread_order_)
    configure(threads_[name], lines);
  for (const auto& [time, line] : lines) {
    if (!state_event(time, line) && !kernel_event(time, line) && !recording_event(time, line)) {
      user_event(time, line);
    }
  }
  epilogue();
  frame();
  return std::move(trace_);
}

}  // namespace text

TextTrace trace_of(std::string_view text) { return text::Writer().write(text); }

analysis::AnalysisResult analyze(const TextTrace& trace, const analysis::AnalysisOptions& options,
                                 analysis::Observer* observer) {
  analysis::Analyzer analyzer(options, observer);
  for (const auto& event : trace.events)
    analyzer.consume(event);
  return analyzer.finish();
}

}  // namespace cie::test
