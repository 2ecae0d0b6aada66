#include "graph.hpp"

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace demo {
namespace {

using example::Command;
using example::Cyclic;
using example::Fusion;
using example::Intersection;
using example::Place;
using example::Sensor;
using example::Transform;
using example::Work;
using namespace std::chrono_literals;

constexpr std::uint32_t kCloud = 16 * 1024;
constexpr std::uint32_t kImage = 32 * 1024;
constexpr std::uint32_t kSmall = 64;

template <typename Kind, typename... Arguments>
void add(Nodes& nodes, const Place& place, Arguments&&... arguments) {
  nodes.push_back(std::make_unique<Kind>(place, std::forward<Arguments>(arguments)...));
}

// Work that nobody waits for.
class Background final : public example::ExampleNode {
 public:
  Background(const Place& place, const std::string& name, std::chrono::nanoseconds cpu_time)
      : ExampleNode(place.context, name, place.name_space),
        timer_(node().create_wall_timer(190ms, [cpu_time] { example::use_cpu(cpu_time); })) {}

 private:
  std::shared_ptr<cie::Timer> timer_;
};

}  // namespace

Nodes make_sensing(const cie::Context& context) {
  const Place here{context, "/sensing"};
  Nodes nodes;
  add<Sensor>(nodes, here, "front_lidar", 100ms, 5ms, "/front/raw", kCloud, Work{100});
  add<Sensor>(nodes, here, "rear_lidar", 100ms, 15ms, "/rear/raw", kCloud, Work{100});
  add<Sensor>(nodes, here, "camera", 50ms, 25ms, "/camera/raw", kImage, Work{200});
  add<Sensor>(nodes, here, "imu", 20ms, 2ms, "/imu/raw", kSmall, Work{20});
  add<Sensor>(nodes, here, "map", 200ms, 30ms, "/map", kSmall, Work{100});
  add<Transform>(nodes, here, "front_transform", "/front/raw", "/front/points", kCloud, Work{800});
  add<Transform>(nodes, here, "rear_transform", "/rear/raw", "/rear/points", kCloud, Work{800});
  add<Transform>(nodes, here, "camera_rectify", "/camera/raw", "/camera/image", kImage, Work{600});
  add<Transform>(nodes, here, "imu_filter", "/imu/raw", "/imu/filtered", kSmall, Work{50});
  add<Fusion>(nodes, here, "cloud_fusion",
              std::array<std::string, 2>{"/front/points", "/rear/points"}, "/points/fused", kCloud,
              Work{700});
  add<Transform>(nodes, here, "ground_filter", "/points/fused", "/points/objects", kCloud,
                 Work{900});
  return nodes;
}

Nodes make_planning(const cie::Context& context, std::chrono::nanoseconds background) {
  const Place here{context, "/planning"};
  Nodes nodes;
  add<Intersection>(nodes, here, "cluster",
                    std::array<Intersection::Path, 2>{
                        {{"/points/objects", "/objects/clusters"}, {"/map", "/map/cropped"}}},
                    kSmall, Work{900});
  add<Fusion>(nodes, here, "localizer", std::array<std::string, 2>{"/imu/filtered", "/map/cropped"},
              "/pose", kSmall, Work{400});
  add<Fusion>(nodes, here, "tracker",
              std::array<std::string, 2>{"/objects/clusters", "/camera/image"}, "/objects/tracks",
              kSmall, Work{800});
  add<Cyclic>(nodes, here, "planner", 100ms, std::vector<std::string>{"/pose", "/objects/tracks"},
              "/trajectory", kSmall, Work{1500});
  add<Transform>(nodes, here, "controller", "/trajectory", "/control", kSmall, Work{300});
  add<Intersection>(nodes, here, "gate",
                    std::array<Intersection::Path, 2>{
                        {{"/control", "/vehicle/drive"}, {"/objects/tracks", "/vehicle/brake"}}},
                    kSmall, Work{100});
  add<Command>(nodes, here, "drive", "/vehicle/drive", Work{50});
  add<Command>(nodes, here, "brake", "/vehicle/brake", Work{50});
  add<Background>(nodes, here, "mapper", background);
  add<Background>(nodes, here, "logger", background);
  return nodes;
}

}  // namespace demo
