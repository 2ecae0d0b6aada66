#include "snapshot_json.hpp"

#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::live {
namespace {

Snapshot full() {
  Snapshot s;
  s.sequence = 3;
  s.state = SourceState::lost;
  s.source = "net://x/host/y/z";
  s.watched = "cie run app.yaml";
  s.message = "gone";
  s.hosts = {{.host = "y\"",
              .session = "z",
              .state = SourceState::ended,
              .silent_ns = 11,
              .message = "cut off"}};
  s.time_ns = std::numeric_limits<std::int64_t>::max();
  s.delay_ns = 5;
  s.lost_events.reset();
  s.defects = {{.kind = "seq-gaps", .severity = "loss", .count = 9}};
  CallbackView c;
  c.index = 4;
  c.logical_id = "a\x1b[2J\"\n\xff";
  c.name = "a ← /b";
  c.tids = {1, 2};
  c.deadline_ns = 8;
  c.is_deadline_of_spec = true;
  c.period_ns = 9;
  c.response = analysis::Summary{.count = 1, .min = 2, .max = 3, .sum = 4, .mean = 5.5, .p50 = 6};
  c.counts.back() = 7;
  c.recent = {{.seq = 1,
               .tid = 2,
               .cpu = 0,
               .start_ns = 3,
               .end_ns = 4,
               .response_ns = 5,
               .is_exact = true,
               .is_late = true,
               .missed = 6,
               .execution_ns = {}}};
  s.callbacks = {c};
  s.threads = {{.host = "h",
                .pid = 1,
                .tid = 2,
                .name = "n",
                .role = "callback",
                .callbacks = {"a"},
                .cpu_percent = 12.5}};
  s.violations = {{.rule = "M2", .name = "n", .subjects = 201}};
  s.verdicts = {{.rule = "M2",
                 .name = "n",
                 .subject = "thread 2",
                 .verdict = analysis::Verdict::fail,
                 .since_ns = 1,
                 .note = "x"}};
  s.changes = {{.time_ns = 1,
                .rule = "M2",
                .name = "n",
                .subject = "thread 2",
                .from = analysis::Verdict::pass,
                .to = analysis::Verdict::fail,
                .note = "x"}};
  return s;
}

TEST(SnapshotJson, IsOneLineThatComesBackAsItWas) {
  const auto line = json_line(full(), true);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  EXPECT_EQ(line.find('\x1b'), std::string::npos);
  EXPECT_EQ(json_line(parse_snapshot(line), true), line);
  const auto back = parse_snapshot(line);
  EXPECT_EQ(back.callbacks.at(0).name, "a ← /b");
  EXPECT_EQ(back.watched, "cie run app.yaml");
  EXPECT_EQ(back.callbacks.at(0).logical_id, "a\x1b[2J\"\n\xEF\xBF\xBD");
  EXPECT_EQ(back.time_ns, std::numeric_limits<std::int64_t>::max());
  EXPECT_FALSE(back.lost_events);
  EXPECT_EQ(back.violations.at(0).subjects, 201U);
  EXPECT_EQ(back.hosts.at(0).host, "y\"");
  EXPECT_EQ(back.hosts.at(0).state, SourceState::ended);
  EXPECT_EQ(back.hosts.at(0).silent_ns, 11);
  EXPECT_EQ(back.callbacks.at(0).recent.at(0).missed, 6U);
}

TEST(SnapshotJson, HasNoLateInstancesWithoutADeadline) {
  const auto callback = nlohmann::json::parse(json_line(full(), false)).at("callbacks").at(0);
  EXPECT_TRUE(callback.at("window").at("late").is_null());
  EXPECT_TRUE(callback.at("total").at("late").is_null());
}

TEST(SnapshotJson, LeavesInstancesOutUnlessAskedFor) {
  const auto json = nlohmann::json::parse(json_line(full(), false));
  EXPECT_FALSE(json.at("callbacks").at(0).contains("recent"));
  EXPECT_TRUE(parse_snapshot(json.dump()).callbacks.at(0).recent.empty());
}

TEST(SnapshotJson, RefusesAnythingElse) {
  for (const auto* text : {"", "{", "[]", "{}", R"({"schema":"cie.live/2"})",
                           R"({"schema":"cie.live/1","sequence":"x"})"}) {
    EXPECT_THROW(parse_snapshot(text), std::runtime_error) << text;
  }
}

TEST(SnapshotJson, SaysWhatItDoesNotKnow) {
  auto json = nlohmann::json::parse(json_line(full(), false));
  json["verdict"] = "PERHAPS";
  try {
    parse_snapshot(json.dump());
    FAIL() << "no verdict is called so";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "not a line of cie.live/1: what is \"PERHAPS\"?");
  }
}

TEST(SnapshotJson, HasItsKeysInTheOrderOfTheContract) {
  EXPECT_TRUE(json_line(full(), false)
                  .starts_with(R"({"schema":"cie.live/1","sequence":3,"source":{"url":"net://x)"));
}

}  // namespace
}  // namespace cie::live
