#include <cie/scheduling/problem.hpp>

#include <utility>

namespace cie {
namespace {

std::string joined(const std::vector<SchedulingProblem>& problems) {
  std::string text;
  for (const SchedulingProblem& problem : problems) {
    text.append(text.empty() ? "" : "\n").append(problem.text());
  }
  return text;
}

}  // namespace

std::string SchedulingProblem::text() const {
  const std::string place = line > 0 ? file + ":" + std::to_string(line) : file;
  return (place.empty() ? "" : place + ": ") + "\"" + entry +
         "\": " + (thread.empty() ? "" : "thread \"" + thread + "\": ") + reason;
}

SchedulingRefused::SchedulingRefused(std::vector<SchedulingProblem> problems)
    : std::runtime_error(joined(problems)), problems_(std::move(problems)) {}

}  // namespace cie
