#include "graph.hpp"

#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace autoware {
namespace {

using example::Command;
using example::Cyclic;
using example::Fusion;
using example::Intersection;
using example::Sample;
using example::Sensor;
using example::Transform;
using example::Work;
using namespace std::chrono_literals;

constexpr std::uint32_t kMessage = 4096;  // as the original's Message4kb
const Work kWork{1500};                   // each node computes as much as any other

class Builder {
 public:
  Builder(const cie::Context& context, KeyFigures& figures)
      : place_{.context = context, .name_space = "/", .queue_depth = 1}, figures_(figures) {}

  const Sensor& sensor(const std::string& name, std::chrono::milliseconds period) {
    return add<Sensor>(name, period, 0ms, topic(name), kMessage, Work{0});
  }
  void transform(const std::string& name, const std::string& input,
                 example::Input::Function on_done = {}) {
    figures_.add_transform(
        name, add<Transform>(name, topic(input), topic(name), kMessage, kWork, std::move(on_done)));
  }
  void fusion(const std::string& name, const std::string& first, const std::string& second) {
    add<Fusion>(name, std::array{topic(first), topic(second)}, topic(name), kMessage, kWork);
  }
  void cyclic(const std::string& name, std::chrono::milliseconds period,
              const std::vector<std::string>& inputs, std::function<void()> on_cycle) {
    std::vector<std::string> topics;
    topics.reserve(inputs.size());
    for (const auto& input : inputs)
      topics.push_back(topic(input));
    add<Cyclic>(name, period, topics, topic(name), kMessage, kWork, std::move(on_cycle));
  }
  void intersection(const std::string& name, const std::array<Intersection::Path, 2>& paths) {
    add<Intersection>(name, paths, kMessage, kWork);
  }
  void command(const std::string& name, const std::string& input) {
    add<Command>(name, topic(input), Work{0});
  }
  static std::string topic(const std::string& name) { return "/" + name; }
  example::Nodes take() { return std::move(nodes_); }

 private:
  template <typename Kind, typename... Arguments>
  const Kind& add(Arguments&&... arguments) {
    auto node = std::make_unique<Kind>(place_, std::forward<Arguments>(arguments)...);
    const Kind& added = *node;
    nodes_.push_back(std::move(node));
    return added;
  }

  example::Place place_;
  KeyFigures& figures_;
  example::Nodes nodes_;
};

}  // namespace

example::Nodes make_graph(const cie::Context& context, KeyFigures& figures) {
  Builder graph{context, figures};
  figures.set_sensor(graph.sensor("FrontLidarDriver", 100ms));
  graph.sensor("RearLidarDriver", 100ms);
  graph.sensor("PointCloudMap", 120ms);
  graph.sensor("Visualizer", 60ms);
  graph.sensor("Lanelet2Map", 100ms);
  graph.sensor("EuclideanClusterSettings", 25ms);

  graph.transform("PointsTransformerFront", "FrontLidarDriver");
  graph.transform("PointsTransformerRear", "RearLidarDriver");
  graph.transform("VoxelGridDownsampler", "PointCloudFusion");
  graph.transform("PointCloudMapLoader", "PointCloudMap");
  graph.transform("RayGroundFilter", "PointCloudFusion");
  graph.transform("ObjectCollisionEstimator", "EuclideanClusterDetector",
                  [&figures](const Sample& sample) { figures.on_hot_path_done(sample.stamp); });
  graph.transform("MPCController", "BehaviorPlanner");
  graph.transform("ParkingPlanner", "Lanelet2MapLoader");
  graph.transform("LanePlanner", "Lanelet2MapLoader");

  graph.fusion("PointCloudFusion", "PointsTransformerFront", "PointsTransformerRear");
  graph.fusion("NDTLocalizer", "VoxelGridDownsampler", "PointCloudMapLoader");
  graph.fusion("VehicleInterface", "MPCController", "BehaviorPlanner");
  graph.fusion("Lanelet2GlobalPlanner", "Visualizer", "NDTLocalizer");
  graph.fusion("Lanelet2MapLoader", "Lanelet2Map", "Lanelet2GlobalPlanner");

  graph.cyclic("BehaviorPlanner", 100ms,
               {"ObjectCollisionEstimator", "NDTLocalizer", "Lanelet2GlobalPlanner",
                "Lanelet2MapLoader", "ParkingPlanner", "LanePlanner"},
               [&figures] { figures.on_planner_cycle(); });
  graph.intersection(
      "EuclideanClusterDetector",
      {{{Builder::topic("RayGroundFilter"), Builder::topic("EuclideanClusterDetector")},
        {Builder::topic("EuclideanClusterSettings"), Builder::topic("EuclideanIntersection")}}});
  graph.command("VehicleDBWSystem", "VehicleInterface");
  graph.command("IntersectionOutput", "EuclideanIntersection");
  return graph.take();
}

}  // namespace autoware
