// Where the spec comes from, and what it does to threads.
#include <cie/scheduling/problem.hpp>

#include "support/rclcpp/tests/spinning.hpp"
#include "support/temporary_directory.hpp"

#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include <sys/resource.h>

namespace cie_rclcpp {
namespace {

using namespace test;
using testing::HasSubstr;

class OptionsTest : public testing::Test {
 protected:
  OptionsTest() { unset(); }
  ~OptionsTest() override {
    unset();
    if (context_) context_->shutdown("end of the test");
  }
  static void unset() {
    unsetenv("CIE_SPEC");
    unsetenv("CIE_ON_ERROR");
  }
  std::string file(const std::string& name, const std::string& text) const {
    const auto path = directory_.path() / name;
    std::ofstream{path} << text;
    return path;
  }
  // Nice 7 for all callbacks of /test/tuned: nobody is refused that.
  std::string spec(const std::string& name = "spec.yaml", int nice = 7) const {
    return file(name,
                "callback_groups:\n  - id: /test/tuned/*\n    policy: SCHED_OTHER\n    nice: " +
                    std::to_string(nice) + "\n    affinity: ~\n");
  }
  rclcpp::Context::SharedPtr context(const std::vector<std::string>& arguments) {
    std::vector<const char*> argv{"program"};
    for (const auto& each : arguments)
      argv.push_back(each.c_str());
    context_ = std::make_shared<rclcpp::Context>();
    context_->init(static_cast<int>(argv.size()), argv.data());
    return context_;
  }

  cie::test::TemporaryDirectory directory_;
  rclcpp::Context::SharedPtr context_;
};

TEST_F(OptionsTest, NoneByThemselves) {
  const auto options = options_from_environment(context({}));
  EXPECT_EQ(options.spec, nullptr);
  EXPECT_EQ(options.on_error, cie::OnError::refuse);
}

TEST_F(OptionsTest, ASpecOfTheEnvironment) {
  setenv("CIE_SPEC", spec().c_str(), 1);
  setenv("CIE_ON_ERROR", "warn", 1);
  const auto options = options_from_environment(context({}));
  ASSERT_NE(options.spec, nullptr);
  EXPECT_EQ(options.spec->callbacks().size(), 1U);
  EXPECT_EQ(options.on_error, cie::OnError::warn);
}

TEST_F(OptionsTest, TheCommandLineGoesBeforeTheEnvironment) {
  setenv("CIE_SPEC", "/nowhere.yaml", 1);
  setenv("CIE_ON_ERROR", "warn", 1);
  const auto options = options_from_environment(
      context({"--ros-args", "-p", "cie_spec:=" + spec(), "-p", "cie_on_error:=refuse"}));
  EXPECT_NE(options.spec, nullptr);
  EXPECT_EQ(options.on_error, cie::OnError::refuse);
}

// A parameter of one node is not for the executor.
TEST_F(OptionsTest, OnlyWhatIsMeantForAllNodes) {
  const auto options = options_from_environment(
      context({"--ros-args", "-p", "tuned:cie_spec:=/nowhere.yaml", "-p", "other:=1"}));
  EXPECT_EQ(options.spec, nullptr);
}

TEST_F(OptionsTest, RefusesAWrongWord) {
  try {
    options_from_environment(context({"--ros-args", "-p", "cie_on_error:=ignore"}));
    FAIL() << "it was taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("\"ignore\""));
    EXPECT_THAT(error.what(), HasSubstr("\"refuse\" or \"warn\""));
  }
  EXPECT_THROW(options_from_environment(context({"--ros-args", "-p", "cie_on_error:=1"})),
               std::invalid_argument)
      << "not a text";
  setenv("CIE_ON_ERROR", "WARN", 1);
  EXPECT_THROW(options_from_environment(context({})), std::invalid_argument);
}

TEST_F(OptionsTest, RefusesAFileThatCannotBeUsed) {
  setenv("CIE_SPEC", "/nowhere.yaml", 1);
  EXPECT_THROW(options_from_environment(context({})), cie::SpecError);
  setenv("CIE_SPEC", file("wrong.yaml", "callback_groups: 7\n").c_str(), 1);
  EXPECT_THROW(CallbackIsolatedExecutor{}, cie::SpecError);
}

TEST_F(OptionsTest, ThreadsRunAsTheSpecSaysAndAnotherSpecChangesThem) {
  rclcpp::ExecutorOptions in_context;
  in_context.context = context({"--ros-args", "-p", "cie_spec:=" + spec()});
  const auto tuned =
      std::make_shared<rclcpp::Node>("tuned", "/test", rclcpp::NodeOptions{}.context(context_));
  std::atomic<int> nice{0};
  const auto timer =
      tuned->create_wall_timer(1ms, [&nice] { nice = getpriority(PRIO_PROCESS, 0); });
  CallbackIsolatedExecutor executor{options_from_environment(context_), in_context};
  executor.add_node(tuned);
  const Spinning spinning{executor};
  EXPECT_TRUE(comes([&] { return nice != 0; }));
  EXPECT_EQ(nice, 7) << "before the first run";
  executor.reload_spec(std::make_shared<const cie::SchedulingSpec>(
      cie::SchedulingSpec::load(spec("other.yaml", 11))));
  EXPECT_TRUE(comes([&] { return nice == 11; }));
  EXPECT_TRUE(executor.scheduling_problems().empty());
}

}  // namespace
}  // namespace cie_rclcpp
