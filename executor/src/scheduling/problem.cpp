#include <cie/scheduling/problem.hpp>

#include <utility>

#include <fmt/format.h>

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
  const std::string place = line > 0 ? fmt::format("{}:{}", file, line) : file;
  return fmt::format("{}\"{}\": {}{}", place.empty() ? "" : place + ": ", entry,
                     thread.empty() ? "" : fmt::format("thread \"{}\": ", thread), reason);
}

SchedulingRefused::SchedulingRefused(std::vector<SchedulingProblem> problems)
    : std::runtime_error(joined(problems)), problems_(std::move(problems)) {}

}  // namespace cie
