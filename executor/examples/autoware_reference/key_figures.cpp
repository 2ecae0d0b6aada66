#include "key_figures.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace autoware {
namespace {

std::int64_t realtime_ns() {
  return std::chrono::nanoseconds{std::chrono::system_clock::now().time_since_epoch()}.count();
}

std::int64_t monotonic_ns() {
  return std::chrono::nanoseconds{std::chrono::steady_clock::now().time_since_epoch()}.count();
}

// Twice what a run of this length needs: a late timer catches up.
std::size_t room(std::chrono::duration<double> length, std::chrono::milliseconds period) {
  return 2 * static_cast<std::size_t>(length / period) + 100;
}

void keep(std::vector<std::int64_t>& values, std::int64_t value) {
  if (values.size() < values.capacity()) values.push_back(value);
}

std::string milliseconds(const Summary& s) {
  constexpr double kMs = 1e6;
  return fmt::format("mean {:.3f}  p99 {:.3f}  min {:.3f}  max {:.3f}  deviation {:.3f} ms ({})",
                     s.mean / kMs, static_cast<double>(s.p99) / kMs,
                     static_cast<double>(s.least) / kMs, static_cast<double>(s.greatest) / kMs,
                     s.deviation / kMs, s.count);
}

}  // namespace

Summary summarize(std::vector<std::int64_t> values) {
  Summary summary{.count = values.size()};
  if (values.empty()) return summary;
  std::ranges::sort(values);
  double m2 = 0;  // Welford's algorithm
  std::size_t seen = 0;
  for (const std::int64_t value : values) {
    const double delta = static_cast<double>(value) - summary.mean;
    summary.mean += delta / static_cast<double>(++seen);
    m2 += delta * (static_cast<double>(value) - summary.mean);
  }
  if (seen > 1) summary.deviation = std::sqrt(m2 / static_cast<double>(seen - 1));
  summary.least = values.front();
  summary.greatest = values.back();
  const auto rank = static_cast<std::size_t>(std::ceil(0.99 * static_cast<double>(seen)));
  summary.p99 = values[std::max<std::size_t>(rank, 1) - 1];
  return summary;
}

KeyFigures::KeyFigures(std::chrono::duration<double> length,
                       std::chrono::milliseconds hot_path_period,
                       std::chrono::milliseconds planner_period)
    : planner_period_(planner_period) {
  hot_path_ns_.reserve(room(length, hot_path_period));
  planner_starts_ns_.reserve(room(length, planner_period));
}

void KeyFigures::on_hot_path_done(std::int64_t stamp) { keep(hot_path_ns_, realtime_ns() - stamp); }

void KeyFigures::on_planner_cycle() { keep(planner_starts_ns_, monotonic_ns()); }

void KeyFigures::add_transform(std::string name, const example::Transform& node) {
  transforms_.push_back({std::move(name), &node});
}

std::string KeyFigures::text() const {
  std::vector<std::int64_t> periods;
  for (std::size_t i = 1; i < planner_starts_ns_.size(); ++i)
    periods.push_back(planner_starts_ns_[i] - planner_starts_ns_[i - 1]);
  const auto planner = summarize(std::move(periods));
  const double target = std::chrono::duration<double, std::nano>(planner_period_).count();
  const double drift = planner.count == 0 ? 0 : planner.mean - target;

  std::string text;
  text += "hot path, front and rear lidar to object collision estimator\n  " +
          milliseconds(summarize(hot_path_ns_)) + '\n';
  text += "behavior planner, period\n  " + milliseconds(planner) + '\n';
  text += fmt::format("  drift {:+.6f} ms per cycle\n", drift / 1e6);
  std::uint64_t dropped = 0;
  std::string lines;
  for (const auto& [name, node] : transforms_) {
    dropped += node->input().missed();
    if (node->input().missed() > 0) {
      lines += fmt::format("  {}: {} of {}\n", name, node->input().missed(),
                           node->input().missed() + node->input().received());
    }
  }
  text += fmt::format("dropped samples in transform nodes: {}\n", dropped) + lines;
  if (front_lidar_ != nullptr) {
    text += fmt::format("front lidar samples {}, object collision estimates {}\n",
                        front_lidar_->output().published(), hot_path_ns_.size());
  }
  return text;
}

}  // namespace autoware
