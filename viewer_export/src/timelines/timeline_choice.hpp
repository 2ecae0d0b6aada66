// Which instances of a long recording a picture of bounded size shows.
#pragma once

#include "output/kept_instance.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cie::viewer_export {

// Keeps at most about `limit` instances of all callbacks: an even choice, thinned as more come, and
// always the slowest of each callback and those that never ended or missed releases (some hundreds
// of each). What is kept depends on the instances and their order only.
class TimelineChoice {
 public:
  explicit TimelineChoice(std::size_t limit) : limit_(limit) {}

  void add(const KeptInstance& instance);

  struct Kept {
    std::vector<KeptInstance> instances;  // by start
    std::uint64_t of = 0;                 // how many there were
  };
  // Of every callback that had an instance, by its number.
  std::vector<Kept> take();

 private:
  struct Lane {
    std::vector<KeptInstance> evenly;
    std::vector<std::uint64_t> numbers;  // of `evenly`: each a multiple of `stride`
    std::vector<KeptInstance> slowest;   // a heap, the least slow first
    std::vector<KeptInstance> remarkable;
    std::uint64_t stride = 1;
    std::uint64_t seen = 0;
  };

  void thin_out();

  std::size_t limit_;
  std::size_t kept_evenly_ = 0;
  std::vector<Lane> lanes_;
};

}  // namespace cie::viewer_export
