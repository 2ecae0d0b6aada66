#include <cie/tracepoints/duration_text.hpp>
#include <cie/tracepoints/nearest_name.hpp>

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace cie {
namespace {

constexpr std::size_t kLongest = 256;  // nobody misspells an essay

// Edits (insert, delete, replace, swap neighbours) that turn one word into the other. Above `most`
// it does not matter how many.
std::size_t distance(std::string_view a, std::string_view b, std::size_t most) {
  const auto longer = std::max(a.size(), b.size());
  if (longer - std::min(a.size(), b.size()) > most) return longer;
  using Row = std::vector<std::size_t>;
  Row before_last(b.size() + 1);
  Row last(b.size() + 1);
  Row row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::swap(before_last, last);
    std::swap(last, row);
    row[0] = i;
    for (std::size_t k = 1; k <= b.size(); ++k) {
      const std::size_t replaced = last[k - 1] + (a[i - 1] == b[k - 1] ? 0 : 1);
      row[k] = std::min({last[k] + 1, row[k - 1] + 1, replaced});
      if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1]) {
        row[k] = std::min(row[k], before_last[k - 2] + 1);
      }
    }
    const auto least = *std::ranges::min_element(row);
    if (least > most + 1) return least;  // even if the next letters are swapped
  }
  return row[b.size()];
}

// How many letters may be wrong: a third of those between what both begin and end with, and at least
// two. Where letters are only left out or added, a third of all: a namespace may be missing.
std::size_t most_edits(std::string_view name, std::string_view candidate) {
  const auto least = std::min(name.size(), candidate.size());
  const auto first = static_cast<std::size_t>(
      std::ranges::mismatch(name.substr(0, least), candidate.substr(0, least)).in1 - name.begin());
  std::size_t last = 0;
  while (first + last < least &&
         name[name.size() - last - 1] == candidate[candidate.size() - last - 1])
    ++last;
  const bool is_part = first + last == least;
  const auto letters = is_part ? candidate.size() : candidate.size() - first - last;
  return std::max<std::size_t>(2, letters / 3);
}

// "/a@Timer(20ms)" as ids of callbacks have it: "/a@Timer(20000000)". What is misspelt need not be an
// id (see logical_id.hpp): its ")" may be missing.
std::string with_period_in_nanoseconds(std::string_view name) {
  constexpr std::string_view kTimer = "@Timer(";
  std::string id(name);
  const auto timer = name.find(kTimer);
  if (timer == std::string_view::npos) return id;
  const auto begin = timer + kTimer.size();
  const auto end = std::min(name.find(')', begin), name.size());
  const auto period = parse_duration(name.substr(begin, end - begin));
  return period ? id.replace(begin, end - begin, std::to_string(*period)) : id;
}

}  // namespace

std::string_view nearest_name(std::string_view as_written,
                              const std::vector<std::string>& candidates) {
  std::string_view best;
  std::size_t best_distance = 0;
  if (as_written.size() > kLongest) return best;
  const auto name = with_period_in_nanoseconds(as_written);
  for (const auto& candidate : candidates) {
    const auto most = most_edits(name, candidate);
    const auto edits = distance(name, candidate, most);
    const bool is_near = edits <= most && edits + 1 < std::max(name.size(), candidate.size());
    if (is_near && (best.empty() || edits < best_distance)) {
      best = candidate;
      best_distance = edits;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates) {
  const auto meant = nearest_name(name, candidates);
  return meant.empty() ? std::string{} : "; did you mean \"" + std::string(meant) + "\"?";
}

}  // namespace cie
