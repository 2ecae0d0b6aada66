// Keeps publications from before their publisher was announced, as where a recorder attaches, until
// observers can be told what is known of them.
#pragma once

#include <cie/analysis/instance.hpp>

#include "model/facts.hpp"

#include <cstdint>
#include <deque>

namespace cie::analysis {

class HeldPublications {
 public:
  // Both are borrowed; `observer` may be null: then none are added.
  HeldPublications(const Model& model, Observer* observer) : model_(model), observer_(observer) {}

  // Without its topic and gid. In order of time.
  void add(std::uint32_t publisher, const Publication& publication);
  // A publisher was announced: tells the first ones, up to one whose publisher still may be.
  void tell_announced();
  // None will be any more.
  void tell_all();

 private:
  struct Held {
    std::uint32_t publisher = 0;
    Publication publication;
  };

  bool may_be_announced(std::uint32_t publisher) const;
  void tell_first();

  const Model& model_;
  Observer* observer_;
  std::deque<Held> held_;
};

}  // namespace cie::analysis
