// What the reference system judges an executor by.
#pragma once

#include "../common/archetypes.hpp"

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace autoware {

// Mean, deviation and extremes of a series of times, in nanoseconds.
struct Summary {
  std::size_t count = 0;
  double mean = 0;
  double deviation = 0;  // of a sample: divided by count - 1
  std::int64_t least = 0;
  std::int64_t p99 = 0;  // nearest rank
  std::int64_t greatest = 0;
};
Summary summarize(std::vector<std::int64_t> values);

// Collects while the system runs, each series on the thread of one callback, without allocating.
class KeyFigures {
 public:
  // Room for a run of this length.
  KeyFigures(std::chrono::duration<double> length, std::chrono::milliseconds hot_path_period,
             std::chrono::milliseconds planner_period);
  KeyFigures(const KeyFigures&) = delete;
  KeyFigures& operator=(const KeyFigures&) = delete;

  // The estimator has published what it made of data sensed at `stamp` (realtime, ns).
  void on_hot_path_done(std::int64_t stamp);
  void on_planner_cycle();
  void set_sensor(const example::Sensor& front_lidar) noexcept { front_lidar_ = &front_lidar; }
  void add_transform(std::string name, const example::Transform& node);

  // Once nobody spins, and while the nodes are there.
  std::string text() const;

 private:
  struct Watched {
    std::string name;
    const example::Transform* node;
  };

  const std::chrono::milliseconds planner_period_;
  std::vector<std::int64_t> hot_path_ns_;
  std::vector<std::int64_t> planner_starts_ns_;
  const example::Sensor* front_lidar_ = nullptr;
  std::vector<Watched> transforms_;
};

}  // namespace autoware
