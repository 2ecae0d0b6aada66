#include "app_file.hpp"

#include <cie/tracepoints/scheduling_spec.hpp>

#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::container {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

AppFile parse(std::string_view text) { return AppFile::parse(text, "app.yaml", "/opt/car"); }

std::string error_of(std::string_view text) {
  try {
    parse(text);
  } catch (const SpecError& error) {
    return error.what();
  }
  return {};
}

TEST(AppFile, SaysWhatRunsWhere) {
  const AppFile app = parse(R"(
executor: multi
spec: specs/car.yaml
on_error: warn
audit_period: 250000000
on_change: apply_again
lock_memory: on_fault
prefault_stack: 65536
domain: 7
loopback: true
discovery_tag: bench
components:
  - library: ./libcar.so
    class: car::Lidar
    name: lidar
    namespace: /sensing
    parameters:
      rate: 10
      frames: [front, "rear"]
      unused: ~
      gain: {near: 1, far: {x: 2.5}}
    remaps: {points: /front/points, ~/status: status}
  - {library: libcar.so, class: car::Planner, name: planner}
)");
  EXPECT_EQ(app.executor, "multi");
  EXPECT_EQ(app.spec, "/opt/car/specs/car.yaml");
  EXPECT_EQ(app.on_error, OnError::warn);
  EXPECT_EQ(app.audit_period, std::chrono::milliseconds{250});
  EXPECT_EQ(app.on_change, OnChange::apply_again);
  EXPECT_EQ(app.lock_memory, LockMemory::on_fault);
  EXPECT_EQ(app.prefault_stack, 65536U);
  EXPECT_EQ(app.domain, 7U);
  EXPECT_EQ(app.is_loopback, true);
  EXPECT_EQ(app.discovery_tag, "bench");
  ASSERT_EQ(app.components.size(), 2U);
  const ComponentEntry& lidar = app.components[0];
  EXPECT_EQ(lidar.line, 13);
  EXPECT_EQ(lidar.library, "/opt/car/libcar.so");
  EXPECT_EQ(lidar.class_name, "car::Lidar");
  EXPECT_EQ(lidar.qualified_name(), "/sensing/lidar");
  ASSERT_EQ(lidar.parameters.size(), 4U);  // a null is as absent
  EXPECT_THAT(lidar.parameters.at("gain.far.x").texts, ElementsAre("2.5"));
  EXPECT_THAT(lidar.parameters.at("rate").texts, ElementsAre("10"));
  EXPECT_FALSE(lidar.parameters.at("rate").is_list);
  EXPECT_THAT(lidar.parameters.at("frames").texts, ElementsAre("front", "rear"));
  EXPECT_TRUE(lidar.parameters.at("frames").is_list);
  EXPECT_THAT(lidar.remaps,
              ElementsAre(Pair("points", "/front/points"), Pair("~/status", "status")));
  EXPECT_EQ(app.components[1].library, "libcar.so");  // the dynamic linker's to find
  EXPECT_EQ(app.components[1].qualified_name(), "/planner");
}

TEST(AppFile, LeavesToTheEnvironmentWhatItDoesNotSay) {
  const AppFile app = parse("components: [{library: a.so, class: A, name: a}]");
  EXPECT_EQ(app.executor, "isolated");
  EXPECT_EQ(app.on_error, OnError::refuse);
  EXPECT_FALSE(app.spec || app.domain || app.is_loopback || app.discovery_tag);
}

struct BadFile {
  std::string text;
  std::string complaint;
};

class BadAppFile : public testing::TestWithParam<BadFile> {};

TEST_P(BadAppFile, IsRefusedWithFileLineAndEntry) {
  EXPECT_THAT(error_of(GetParam().text), HasSubstr(GetParam().complaint));
}

constexpr const char* kGood = "components:\n  - library: a.so\n    class: A\n    name: a\n";

INSTANTIATE_TEST_SUITE_P(
    Mistakes, BadAppFile,
    testing::Values(
        BadFile{"", "app.yaml:1: empty"}, BadFile{"executor: single\n", "no \"components\""},
        BadFile{"components: []\n", "app.yaml:1: \"components\" is empty"},
        BadFile{std::string{kGood} + "executer: multi\n", "app.yaml:5: unknown key \"executer\""},
        BadFile{std::string{kGood} + "audit_period: 5\n", "app.yaml:5: \"audit_period\" is below"},
        BadFile{std::string{kGood} + "lock_memory: maybe\n", "write no, on_fault or all"},
        BadFile{std::string{kGood} + "prefault_stack: -1\n", "prefault_stack"},
        BadFile{std::string{kGood} + "on_change: sulk\n", "write report or apply_again"},
        BadFile{std::string{kGood} + "executor: magic\n", "unknown executor \"magic\""},
        BadFile{std::string{kGood} + "on_error: ignore\n", "app.yaml:5: \"on_error\""},
        BadFile{std::string{kGood} + "loopback: yes\n", "write true or false"},
        BadFile{std::string{kGood} + "domain: 233\n", "from 0 to 232"},
        BadFile{std::string{kGood} + "    period: 5\n",
                "app.yaml:5: entry \"a\": unknown key \"period\""},
        BadFile{std::string{kGood} + "    remaps: {a: [b]}\n", "entry \"a\": \"a\" is a list"},
        BadFile{std::string{kGood} + "    parameters: [1]\n", "entry \"a\": \"parameters\" is"},
        BadFile{std::string{kGood} + "    parameters: {p: [{q: 1}]}\n", "\"p\" is a map"},
        BadFile{"components:\n  - class: A\n    name: a\n",
                "app.yaml:2: entry \"a\": a component needs \"library\""},
        BadFile{"components:\n  - library: a.so\n    name: a\n",
                "entry \"a\": a component needs \"class\""},
        BadFile{"components:\n  - library: a.so\n    class: A\n", "needs \"name\""},
        BadFile{std::string{kGood} + "  - {library: b.so, class: B, name: a, namespace: /}\n",
                "app.yaml:5: entry \"a\": a component \"/a\" stands already at line 2"}));

}  // namespace
}  // namespace cie::container
