// Each mutant fires exactly the rules that it must, by what rules.md says and no more.
#include "simulator/mutants.hpp"

#include <cie/analysis/rule_pages.hpp>

#include "support/verdicts.hpp"

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <map>

#include <gtest/gtest.h>

namespace cie::sim {
namespace {

using analysis::Verdict;

std::vector<Mutant> all_mutants() {
  std::vector<Mutant> all;
  for (auto& some : {trace_mutants(), mapping_mutants(), parameter_mutants(), execution_mutants(),
                     timing_mutants()}) {
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

struct Fired {
  std::map<std::string, Verdict> verdicts;
  std::string why;

  Rules with(Verdict verdict) const {
    Rules rules;
    for (const auto& [rule, said] : verdicts) {
      if (said == verdict) rules.insert(rule);
    }
    return rules;
  }
};

Fired fire(const Mutant& mutant, std::uint64_t seed) {
  const auto system = mutant.system ? mutant.system() : base_system();
  auto c = mutant.is_clean ? clean_case(system, seed) : any_case(system, seed);
  mutant.change(c);
  const test::Verified verified(c.trace, c.spec.text(), c.options);
  Fired fired;
  for (const auto& rule : verified.result.verdicts.rules) {
    fired.verdicts[rule.id] = rule.verdict;
    for (const auto& subject : rule.subjects) {
      if (subject.verdict <= Verdict::pass) continue;
      fired.why += rule.id + ' ' + subject.subject + ' ' + std::string(label(subject.verdict)) +
                   '\n' + verified.evidence(rule.id, subject.subject);
    }
  }
  return fired;
}

std::string joined(const Rules& rules) {
  std::string text;
  for (const auto& rule : rules)
    text += rule + ' ';
  return text;
}

constexpr std::uint64_t kSeeds = 3;

struct Killing {
  Mutant mutant;
  std::vector<Fired> fired;  // by seed
};

const std::vector<Killing>& killings() {
  static const auto all = [] {
    std::vector<Killing> made;
    for (const auto& mutant : all_mutants()) {
      auto& killing = made.emplace_back(Killing{.mutant = mutant, .fired = {}});
      for (std::uint64_t seed = 0; seed < kSeeds; ++seed)
        killing.fired.push_back(fire(mutant, seed));
    }
    return made;
  }();
  return all;
}

std::vector<std::string> rule_ids() {
  std::vector<std::string> ids;
  for (const auto& page : analysis::rule_pages())
    ids.emplace_back(page.id);
  return ids;
}

// The verdict on everything, if one rule did not exist.
Verdict overall_without(const Fired& fired, const std::string& rule) {
  auto worst = Verdict::pass;
  for (const auto& [id, verdict] : fired.verdicts) {
    if (id != rule) worst = std::max(worst, verdict);
  }
  return worst;
}

TEST(Mutants, FireExactlyTheirRules) {
  for (const auto& [mutant, all_fired] : killings()) {
    for (const auto& fired : all_fired) {
      const auto name = mutant.rule + ", " + mutant.name + '\n' + fired.why;
      EXPECT_EQ(joined(fired.with(Verdict::fail)), joined(mutant.fails)) << name;
      EXPECT_EQ(joined(fired.with(Verdict::inconclusive)), joined(mutant.doubts)) << name;
    }
  }
}

TEST(Mutants, EveryRuleHasThreeOfItsOwn) {
  const auto mutants = all_mutants();
  for (const auto& rule : rule_ids()) {
    const auto count = std::ranges::count_if(mutants, [&rule](const Mutant& mutant) {
      return mutant.rule == rule && (mutant.fails.contains(rule) || mutant.doubts.contains(rule));
    });
    EXPECT_GE(count, 3) << rule;
  }
}

// Without any one rule some mutant would get a better verdict than it deserves. All but E3: another
// callback inside an instance is M2's concern as well, and another instance of the same one E2's.
TEST(Mutants, NoRuleCanBeSpared) {
  for (const auto& rule : rule_ids()) {
    const bool is_needed = std::ranges::any_of(killings(), [&rule](const Killing& killing) {
      const auto& fired = killing.fired.front();
      return overall_without(fired, rule) < overall_without(fired, "");
    });
    EXPECT_EQ(is_needed, rule != "E3") << rule;
  }
}

// F: fails, ?: inconclusive, .: silent.
TEST(Mutants, ConfusionMatrix) {
  constexpr int kWidth = 62;
  const auto rules = rule_ids();
  std::cout << std::left << std::setw(kWidth) << "mutant";
  for (const auto& rule : rules)
    std::cout << rule << ' ';
  std::cout << '\n';
  for (const auto& [mutant, all_fired] : killings()) {
    std::cout << std::setw(kWidth) << mutant.rule + ' ' + mutant.name;
    for (const auto& rule : rules) {
      const auto verdict = all_fired.front().verdicts.at(rule);
      std::cout << (verdict == Verdict::fail           ? "F  "
                    : verdict == Verdict::inconclusive ? "?  "
                                                       : ".  ");
      const auto expected = mutant.fails.contains(rule)    ? Verdict::fail
                            : mutant.doubts.contains(rule) ? Verdict::inconclusive
                                                           : Verdict::pass;
      EXPECT_EQ(std::max(verdict, Verdict::pass), expected) << rule << ' ' << mutant.name;
    }
    std::cout << '\n';
  }
}

}  // namespace
}  // namespace cie::sim
