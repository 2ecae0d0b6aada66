// How programs read their arguments, and how they end.
#include "base/program.hpp"

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class ProgramsArguments : public testing::Test {
 protected:
  ProgramsArguments() : app("Tries.") {
    app.add_option("--size", size);
    app.add_option("FILE", file);
    app.add_option("-n,--name", name)->type_name("NAME");
    app.add_option("--how", how)->expected(0, 1);
    app.set_version_flag("--version", std::string("try 1.2"));
  }
  std::string wrong(const std::vector<std::string>& arguments) {
    try {
      parse_arguments(app, arguments);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "nothing";
  }

  CLI::App app;
  int size = 0;
  std::string file;
  std::string name;
  std::string how;
};

TEST_F(ProgramsArguments, AreReadInTheirOrder) {
  EXPECT_FALSE(parse_arguments(app, {"a", "--size", "7"}));
  EXPECT_EQ(file, "a");
  EXPECT_EQ(size, 7);
}

TEST_F(ProgramsArguments, MayAskForATextOnly) {
  EXPECT_THAT(parse_arguments(app, {"--help"}).value(), HasSubstr("--size"));
  EXPECT_EQ(parse_arguments(app, {"--version"}), "try 1.2\n");
}

TEST_F(ProgramsArguments, AreWrongWhereNoOptionTakesThem) {
  EXPECT_EQ(wrong({"a", "b"}), "one argument too many: \"b\"");
  EXPECT_THAT(wrong({"--sise", "7"}), StartsWith("unknown option \"--sise\""));
  EXPECT_THAT(wrong({"--size"}), StartsWith("--size needs a value"));
  EXPECT_EQ(wrong({}), "nothing");
}

// As of a variable that a script does not have.
TEST_F(ProgramsArguments, AreWrongWhereAValueIsEmpty) {
  EXPECT_EQ(wrong({"-n", ""}), "--name needs a value: --name NAME");
  EXPECT_EQ(wrong({"--name", "", "a"}), "--name needs a value: --name NAME");
  EXPECT_EQ(wrong({""}), "FILE is empty");
  EXPECT_EQ(wrong({"--how"}), "nothing") << "it needs none";
}

int exit_code_of(const std::function<int()>& body) { return run_program("cie try", "cie", body); }

TEST(Program, EndsWithTheCodeOfWhatItThrows) {
  EXPECT_EQ(exit_code_of([] { return 7; }), 7);
  testing::internal::CaptureStderr();
  EXPECT_EQ(exit_code_of([]() -> int { throw UsageError("no FILE"); }), kWrongUsage);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "cie: no FILE\nTry: cie try --help\n");
  testing::internal::CaptureStderr();
  EXPECT_EQ(exit_code_of([]() -> int { throw std::runtime_error("gone"); }), kFailed);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "cie: gone\n");
  testing::internal::CaptureStderr();
  EXPECT_EQ(exit_code_of([]() -> int { throw 3; }), kFailed);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "cie: unknown exception\n");
}

}  // namespace
}  // namespace cie
