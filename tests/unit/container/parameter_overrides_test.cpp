// What the command line says about parameters.
#include "parameter_overrides.hpp"

#include <cie/tracepoints/scheduling_spec.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace cie::container {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

class Overrides : public testing::Test {
 protected:
  AppFile app = AppFile::parse(
      "components:\n"
      "  - {library: a.so, class: A, name: talker, namespace: /demo, parameters: {period_ms: 20}}\n"
      "  - {library: a.so, class: A, name: listener}\n",
      "app.yaml", "/");
  const ParameterText& talker(const std::string& name) {
    return app.components[0].parameters.at(name);
  }
};

TEST_F(Overrides, OfTheCommandLineReplaceAndAdd) {
  override_parameter(app, "/demo/talker:period_ms:=50");
  override_parameter(app, "/demo/talker:frames:=[front, rear]");
  override_parameter(app, "/listener:greeting:=a:=b");
  EXPECT_THAT(talker("period_ms").texts, ElementsAre("50"));
  EXPECT_THAT(talker("frames").texts, ElementsAre("front", "rear"));
  EXPECT_THAT(app.components[1].parameters.at("greeting").texts, ElementsAre("a:=b"));
  EXPECT_EQ(app.components[0].overridden.at("period_ms"), "-p /demo/talker:period_ms:=50");
  EXPECT_FALSE(app.components[0].overridden.contains("greeting"));
}

TEST_F(Overrides, OfTheCommandLineAreRefusedWhenNothingIsMeant) {
  for (const char* const text :
       {"", "period_ms:=50", "/demo/talker:period_ms=50", ":p:=1", "/demo/talker::=1"}) {
    EXPECT_THAT([&] { override_parameter(app, text); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("NODE:NAME:=VALUE")));
  }
  EXPECT_THAT([&] { override_parameter(app, "/talker:p:=1"); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("no component \"/talker\"")));
}

class OverrideFiles : public Overrides {
 protected:
  void read(const std::string& text) {
    const auto file = std::filesystem::temp_directory_path() /
                      ("cie-params-" + std::to_string(getpid()) + ".yaml");
    std::ofstream{file} << text;
    try {
      override_parameters(app, file);
    } catch (...) {
      std::filesystem::remove(file);
      throw;
    }
    std::filesystem::remove(file);
  }
};

TEST_F(OverrideFiles, AreThoseOfRos) {
  read(
      "/demo/talker:\n"
      "  ros__parameters:\n"
      "    period_ms: 50\n"
      "    gain: {near: 1.5}\n"
      "listener: {ros__parameters: {names: [a]}}\n"
      "/elsewhere: {ros__parameters: {p: 1}}\n");
  EXPECT_THAT(talker("period_ms").texts, ElementsAre("50"));
  EXPECT_THAT(talker("gain.near").texts, ElementsAre("1.5"));
  EXPECT_THAT(app.components[0].overridden.at("gain.near"), HasSubstr("cie-params-"));
  EXPECT_THAT(app.components[1].parameters.at("names").texts, ElementsAre("a"));
}

TEST_F(OverrideFiles, AreRefusedWithLineAndReason) {
  EXPECT_THAT([&] { read("/**:\n  ros__parameters: {p: 1}\n"); },
              ThrowsMessage<SpecError>(HasSubstr("is a pattern")));
  EXPECT_THAT([&] { read("/demo/talker:\n  parameters: {p: 1}\n"); },
              ThrowsMessage<SpecError>(HasSubstr(":2: ")));
  EXPECT_THAT([&] { override_parameters(app, "/absent.yaml"); },
              ThrowsMessage<SpecError>(HasSubstr("cannot read it")));
}

}  // namespace
}  // namespace cie::container
