// What claims the rules of the small system have in common.
#pragma once

#include "small_facts.hpp"
#include "small_rules.hpp"

#include <string>
#include <vector>

namespace cie::test::small {

using analysis::Verdict;

// Claims with the reason of a need in words, which the tally of the undecided shows.
class NamedClaims {
 public:
  explicit NamedClaims(const analysis::Knowledge& knowledge) : claims_{knowledge} {}

  void checked(std::size_t count = 1) { claims_.checked(count); }
  void violation(const char* witness, const std::vector<Conjunction>& excuses = {}) {
    claims_.violation(std::string{witness}, excuses);
  }
  void needs(const char* why, const Conjunction& hidden) {
    const bool was_undecided = claims_.verdict() == Verdict::inconclusive;
    claims_.needs(hidden);
    if (!was_undecided && claims_.verdict() == Verdict::inconclusive) {
      why_ = why;
    }
  }
  Judged judged() const {
    return {claims_.verdict(), claims_.witnesses().empty() ? why_ : claims_.witnesses().front()};
  }

 private:
  analysis::Claims<std::string> claims_;
  std::string why_;
};

inline Conjunction start_within(const Instance& instance) {
  return {Facts::of_callback(EventKind::run_start, {instance.since, instance.until},
                             instance.callback, true)};
}

// Of a callback, or of a thread.
void m2(const Facts& facts, int tid, NamedClaims& claims);
void m3(const Facts& facts, int callback, NamedClaims& claims);
void m4(const Facts& facts, int callback, NamedClaims& claims);
void m7(const Facts& facts, int id, NamedClaims& claims);
void m9(const Facts& facts, int tid, NamedClaims& claims);

}  // namespace cie::test::small
