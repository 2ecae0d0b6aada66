// What tests of cie-record with a real session daemon share.
#pragma once

#include "sandbox.hpp"
#include "trace_text.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace cie::test {

// Recordings of traced_app, each test as who runs it and as an ordinary user.
class Record : public ::testing::TestWithParam<User> {
 protected:
  void SetUp() override {
    if (!sandbox_.skip_reason().empty()) GTEST_SKIP() << sandbox_.skip_reason();
  }

  std::filesystem::path path(const std::string& name) const { return sandbox_.directory() / name; }

  // cie-record -o NAME [OPTIONS] -- traced_app ARGUMENTS
  static std::vector<std::string> recording(const std::string& name,
                                            const std::vector<std::string>& arguments,
                                            const std::vector<std::string>& options = {}) {
    std::vector<std::string> command{CIE_RECORD, "-o", name};
    command.insert(command.end(), options.begin(), options.end());
    command.insert(command.end(), {"--", CIE_TRACED_APP});
    command.insert(command.end(), arguments.begin(), arguments.end());
    return command;
  }

  nlohmann::json manifest(const std::string& name) const {
    return nlohmann::json::parse(read_file(path(name) / "manifest.json"));
  }

  // The pid that traced_app wrote once everything was registered.
  pid_t wait_until_ready(const std::string& file) const {
    EXPECT_TRUE(eventually([&] { return std::filesystem::exists(path(file)); }))
        << "the application hangs";
    return static_cast<pid_t>(std::stoi(read_file(path(file))));
  }

  // Until everything that describes the application and 20 of its instances are on the disk, which
  // takes a short --flush-interval.
  void wait_until_recorded(const std::string& name) const {
    EXPECT_TRUE(eventually([&] {
      if (!std::filesystem::exists(path(name) / "ust")) return false;
      const TextTrace trace = read_trace(path(name));
      // An application that runs already tells the parameters of its threads, too.
      const bool is_sched_due = has_all({"run_begin"}, trace) &&
                                trace.all("run_begin").front().label("moment") == "announce";
      return has_all({"run_begin", "node_init", "group_init", "callback_init", "publisher_init",
                      "thread_init", is_sched_due ? "thread_sched" : "thread_init", "clock_sync"},
                     trace) &&
             trace.all("callback_init").size() >= 2 && trace.all("callback_end").size() >= 40;
    })) << name
        << " stays empty";
  }

  static bool has_all(const std::vector<const char*>& names, const TextTrace& trace) {
    return std::ranges::all_of(names, [&](const char* name) { return !trace.all(name).empty(); });
  }

  Sandbox sandbox_{GetParam()};
};

// Numbers of one callback's starts, in order.
inline std::vector<std::int64_t> starts_of(const TextTrace& trace, std::int64_t callback) {
  std::vector<std::int64_t> result;
  for (const TextEvent& event : trace.all("callback_start")) {
    if (event.integer("callback_id") == callback) {
      result.push_back(event.integer("seq"));
    }
  }
  return result;
}

inline std::vector<std::int64_t> sequence(std::int64_t from, std::size_t count) {
  std::vector<std::int64_t> result(count);
  for (std::size_t i = 0; i < count; ++i) {
    result[i] = from + static_cast<std::int64_t>(i);
  }
  return result;
}

// Everything registered is described, whatever moment the description is of.
inline void expect_all_state(const TextTrace& trace, const std::string& moment) {
  ASSERT_FALSE(trace.events.empty());
  ASSERT_FALSE(trace.all("run_begin").empty());
  EXPECT_EQ(trace.all("run_begin").front().label("moment"), moment);
  EXPECT_EQ(trace.all("run_begin").front().label("executor"), "isolated");
  EXPECT_EQ(trace.all("run_begin").front().integer("contract_version"), 1);
  std::set<std::string> kinds;
  for (const TextEvent& event : trace.all("callback_init")) {
    kinds.insert(event.label("kind") + " " + event.label("logical_id"));
  }
  EXPECT_EQ(kinds, (std::set<std::string>{"timer /test/node@Timer(1000000)",
                                          "subscription /test/node@Subscription(/test/topic)"}));
  EXPECT_EQ(trace.all("node_init").front().label("name"), "/test/node");
  EXPECT_EQ(trace.all("group_init").front().label("type"), "mutually_exclusive");
  EXPECT_EQ(trace.all("publisher_init").front().label("topic"), "/test/topic");
  EXPECT_EQ(trace.all("thread_init").front().label("role"), "pool");
}

inline std::string name_of_user(const ::testing::TestParamInfo<User>& test) {
  return test.param == User::current ? "CurrentUser" : "OrdinaryUser";
}

}  // namespace cie::test
