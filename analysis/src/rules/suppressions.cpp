#include <cie/analysis/rule_pages.hpp>
#include <cie/analysis/suppressions.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "base/yaml_fields.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

namespace cie::analysis {
namespace {

constexpr std::array<std::string_view, 1> kSections{"suppressions"};
constexpr std::array<std::string_view, 4> kKeys{"rule", "subject", "reason", "expires"};
constexpr std::size_t kMaxEntries = 10'000;  // each is held against every verdict

// `*` stands for any text, nothing included; the rest for itself.
bool matches(std::string_view pattern, std::string_view text) noexcept {
  std::size_t p = 0;
  std::size_t t = 0;
  std::optional<std::size_t> star;  // the last one met, and where its text ends so far
  std::size_t star_end = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      star_end = t;
    } else if (p < pattern.size() && pattern[p] == text[t]) {
      ++p;
      ++t;
    } else if (star) {
      p = *star + 1;
      t = ++star_end;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

// One that does not tell subjects of one name apart means them all.
bool names(const Suppression& suppression, const SubjectVerdict& subject) {
  if (matches(suppression.subject, subject.subject) || matches(suppression.subject, subject.name()))
    return true;
  return !subject.ordinal.empty() &&
         (matches(suppression.subject, subject.name_told_apart()) ||
          matches(suppression.subject, std::string(subject.name()) + subject.ordinal));
}

const std::string& required(const yaml::Fields& entry, std::string_view key,
                            std::string_view remedy) {
  const auto* value = entry.find(key);
  if (value == nullptr) {
    entry.map().fail('"' + std::string(key) + "\" is missing; " + std::string(remedy));
  }
  const auto& text = value->text(key);
  if (text.find_first_not_of(' ') == std::string::npos) {
    value->fail('"' + std::string(key) + "\" is empty; " + std::string(remedy));
  }
  return text;
}

void check_rule(const yaml::Fields& entry, const std::string& rule) {
  if (find_rule_page(rule) == nullptr) {
    entry.find("rule")->fail("there is no rule \"" + rule +
                             "\"; cie verify --list-rules names them all");
  }
  if (rule == kReadableRule) {
    entry.find("rule")->fail(rule +
                             " cannot be suppressed: a trace that cannot be read shows nothing");
  }
}

// The last day; empty for "never".
std::optional<Date> read_expiry(const yaml::Fields& entry, const std::string& text) {
  if (text == "never") return std::nullopt;
  const auto date = parse_date(text);
  if (!date) {
    entry.find("expires")->fail("\"expires\" is \"" + text +
                                "\"; write its last day as in 2026-12-31, or never");
  }
  return date;
}

std::string iso(Date date) {
  const auto padded = [](std::int64_t value, std::size_t width) {
    const auto digits = std::to_string(value);
    return std::string(width - std::min(width, digits.size()), '0') + digits;
  };
  return padded(static_cast<int>(date.year()), 4) + '-' +
         padded(static_cast<unsigned>(date.month()), 2) + '-' +
         padded(static_cast<unsigned>(date.day()), 2);
}

}  // namespace

std::optional<Date> parse_date(std::string_view text) noexcept {
  constexpr std::size_t kLength = 10;  // YYYY-MM-DD
  if (text.size() != kLength || text[4] != '-' || text[7] != '-') return std::nullopt;
  const auto number = [text](std::size_t at, std::size_t length) -> std::optional<unsigned> {
    const auto digits = text.substr(at, length);
    if (digits.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
    unsigned value = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return value;
  };
  const auto year = number(0, 4);
  const auto month = number(5, 2);
  const auto day = number(8, 2);
  if (!year || !month || !day) return std::nullopt;
  const Date date{std::chrono::year{static_cast<int>(*year)}, std::chrono::month{*month},
                  std::chrono::day{*day}};
  return date.ok() ? std::optional(date) : std::nullopt;
}

Suppressions Suppressions::parse(std::string_view text, std::string_view name) {
  const auto document = yaml::parse(text, name, "suppressions: []");
  const yaml::Fields sections{yaml::Value{*document, name}, "the file", kSections};
  Suppressions suppressions;
  const auto* list = sections.find("suppressions");
  if (list == nullptr) return suppressions;
  const auto items = list->items("suppressions");
  if (items.size() > kMaxEntries) list->fail("more than 10000 entries; use patterns");
  for (const auto& item : items) {
    yaml::Fields fields{item, "a suppression", kKeys};
    const auto rule = as_rule_id(required(fields, "rule", "name the rule, as in R2"));
    fields.set_entry(rule);
    const auto& subject =
        required(fields, "subject", "name it as the verdict does, as in callback /lidar/*");
    std::string title = rule;
    fields.set_entry((title += ' ') += subject);
    check_rule(fields, rule);
    const auto& reason = required(fields, "reason", "say why the verdict is accepted");
    const auto& expires =
        required(fields, "expires", "write its last day as in 2026-12-31, or never");
    auto& entry = suppressions.entries_.emplace_back();
    entry.last_day = read_expiry(fields, expires);
    entry.suppression = {.rule = rule,
                         .subject = subject,
                         .reason = reason,
                         .expires = expires,
                         .place = std::string(name) + ':' + std::to_string(item.line())};
  }
  return suppressions;
}

Suppressions Suppressions::load(const std::filesystem::path& file) {
  return parse(yaml::read_file(file), file.string());
}

void Suppressions::apply(VerdictReport& verdicts, Date today) const {
  SuppressionReport report{.date = iso(today), .uses = {}};
  for (const auto& entry : entries_) {
    const auto rule = std::ranges::find(verdicts.rules, entry.suppression.rule, &RuleVerdict::id);
    if (rule == verdicts.rules.end()) continue;
    auto& use = report.uses.emplace_back();
    use.suppression = entry.suppression;
    use.suppression.is_expired = entry.last_day && *entry.last_day < today;
    for (auto& subject : rule->subjects) {
      if (subject.verdict < Verdict::inconclusive) continue;
      if (!names(entry.suppression, subject)) continue;
      ++use.matched;
      const bool is_better = !subject.suppression || !use.suppression.is_expired;
      if (!subject.is_suppressed() && is_better) subject.suppression = use.suppression;
    }
  }
  for (auto& use : report.uses) {
    const auto& rule = *std::ranges::find(verdicts.rules, use.suppression.rule, &RuleVerdict::id);
    use.counting = static_cast<std::uint64_t>(
        std::ranges::count_if(rule.subjects, [&use](const SubjectVerdict& subject) {
          return subject.verdict >= Verdict::inconclusive && !subject.is_suppressed() &&
                 names(use.suppression, subject);
        }));
  }
  verdicts.suppressions = std::move(report);
  verdicts.verdict = overall_verdict(verdicts);
}

}  // namespace cie::analysis
