#include "metrics.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

bool has_line(const std::string& text, const std::string& line) {
  return ('\n' + text).find('\n' + line + '\n') != std::string::npos;
}

Snapshot snapshot() {
  Snapshot s;
  s.sequence = 1;
  s.state = SourceState::streaming;
  s.events = 12;
  CallbackView c;
  c.host = "h";
  c.pid = 7;
  c.logical_id = "/a";
  c.deadline_ns = 2'500'000;
  c.counts[0] = 4;  // up to 10 us
  c.counts[2] = 3;  // up to 50 us
  c.counts.back() = 2;
  c.response_sum_ns = 3'000'000'000;
  c.total_late = 5;
  c.total_missed = 6;
  s.callbacks = {c};
  return s;
}

VerdictView violation(const std::string& subject) {
  return {.rule = "M2",
          .name = "one",
          .subject = subject,
          .verdict = analysis::Verdict::fail,
          .since_ns = 0,
          .note = {}};
}

TEST(Metrics, CountsOfClassesAddUpAsPrometheusWantsThem) {
  Metrics metrics;
  metrics.add(snapshot());
  const auto text = metrics.text();
  const std::string of = R"({host="h",pid="7",callback="/a")";
  for (const auto* expected : {",le=\"1e-05\"} 4", ",le=\"2e-05\"} 4", ",le=\"5e-05\"} 7",
                               ",le=\"10\"} 7", ",le=\"+Inf\"} 9"}) {
    EXPECT_TRUE(has_line(text, "cie_callback_response_time_seconds_bucket" + of + expected))
        << expected << '\n'
        << text;
  }
  EXPECT_TRUE(has_line(text, "cie_callback_response_time_seconds_sum" + of + "} 3"));
  EXPECT_TRUE(has_line(text, "cie_callback_response_time_seconds_count" + of + "} 9"));
  EXPECT_TRUE(has_line(text, "cie_callback_deadline_seconds" + of + "} 0.0025"));
  EXPECT_TRUE(has_line(text, "cie_callback_late_total" + of + "} 5"));
  EXPECT_TRUE(has_line(text, "cie_callback_missed_releases_total" + of + "} 6"));
  EXPECT_TRUE(has_line(text, "cie_live_up 1"));
  EXPECT_TRUE(has_line(text, "cie_live_events_total 12"));
}

TEST(Metrics, WhatIsNoTimerHasNoMissedReleases) {
  Metrics metrics;
  auto s = snapshot();
  s.callbacks[0].total_missed.reset();
  metrics.add(s);
  EXPECT_EQ(metrics.text().find("cie_callback_missed_releases_total{"), std::string::npos);
}

TEST(Metrics, TellForHowLongAnInstanceHasBeenOpen) {
  const std::string of = R"(cie_callback_open_seconds{host="h",pid="7",callback="/a"})";
  Metrics metrics;
  auto s = snapshot();
  metrics.add(s);
  EXPECT_TRUE(has_line(metrics.text(), of + " 0"));
  s.callbacks.push_back(s.callbacks[0]);
  s.callbacks[1].open_ns = 4'500'000'000;
  metrics.add(s);
  EXPECT_TRUE(has_line(metrics.text(), of + " 4.5"));
}

TEST(Metrics, LabelsAreEscaped) {
  Metrics metrics;
  auto s = snapshot();
  s.callbacks[0].logical_id = "a\"b\\c\nd\xff";
  metrics.add(s);
  EXPECT_NE(metrics.text().find("callback=\"a\\\"b\\\\c\\nd\xEF\xBF\xBD\""), std::string::npos);
}

TEST(Metrics, OneSeriesForCallbacksOfOneName) {
  Metrics metrics;
  auto s = snapshot();
  s.callbacks.push_back(s.callbacks[0]);
  metrics.add(s);
  const auto text = metrics.text();
  EXPECT_TRUE(has_line(text, R"(cie_callback_late_total{host="h",pid="7",callback="/a"} 10)"));
  EXPECT_TRUE(has_line(
      text, R"(cie_callback_response_time_seconds_count{host="h",pid="7",callback="/a"} 18)"));
}

TEST(Metrics, CountsLateInstancesOnlyWhereThereIsADeadline) {
  Metrics metrics;
  auto s = snapshot();
  s.callbacks[0].deadline_ns.reset();
  s.callbacks[0].total_late.reset();
  metrics.add(s);
  EXPECT_EQ(metrics.text().find("\ncie_callback_late_total{"), std::string::npos);
}

TEST(Metrics, CountersOfASeriesGoOnWhenTheFirstOfItsProcessesIsForgotten) {
  constexpr const char* kLate = R"(cie_callback_late_total{host="h",pid="7",callback="/a"} )";
  constexpr const char* kMissed =
      R"(cie_callback_missed_releases_total{host="h",pid="7",callback="/a"} )";
  constexpr const char* kCount =
      R"(cie_callback_response_time_seconds_count{host="h",pid="7",callback="/a"} )";
  Metrics metrics;
  auto s = snapshot();
  auto& before = s.callbacks.front();
  before.index = 0;
  auto next = before;  // the next process of that pid
  next.index = 1;
  s.callbacks.push_back(next);
  metrics.add(s);
  s.callbacks.erase(s.callbacks.begin());
  s.callbacks.front().total_late = 6;
  for (int twice = 0; twice < 2; ++twice) {
    metrics.add(s);
    EXPECT_TRUE(has_line(metrics.text(), kLate + std::to_string(5 + 6)));
    EXPECT_TRUE(has_line(metrics.text(), kMissed + std::to_string(6 + 6)));
    EXPECT_TRUE(has_line(metrics.text(), kCount + std::to_string(9 + 9)));
  }
  s.callbacks.clear();
  metrics.add(s);
  EXPECT_EQ(metrics.text().find(kLate), std::string::npos);
  s.callbacks = {next};
  metrics.add(s);
  EXPECT_TRUE(has_line(metrics.text(), kLate + std::to_string(5))) << "a series that begins anew";
}

TEST(Metrics, ViolationsAreCountedAsTheyBeginAndAsTheyAre) {
  Metrics metrics;
  auto s = snapshot();
  s.verdicts = {violation("thread 1")};  // a list that was cut
  s.violations = {{.rule = "M2", .name = "one", .subjects = 2}};
  s.changes = {{.time_ns = 1,
                .rule = "M2",
                .name = "one",
                .subject = "thread 1",
                .from = analysis::Verdict::pass,
                .to = analysis::Verdict::fail,
                .note = {}}};
  metrics.add(s);
  EXPECT_TRUE(has_line(metrics.text(), R"(cie_rule_violations{rule="M2",name="one"} 2)"));
  s.verdicts.clear();
  s.violations.clear();
  s.changes[0].to = analysis::Verdict::pass;
  metrics.add(s);
  EXPECT_TRUE(has_line(metrics.text(), R"(cie_rule_violations{rule="M2",name="one"} 0)"));
  EXPECT_TRUE(
      has_line(metrics.text(), R"(cie_rule_violations_begun_total{rule="M2",name="one"} 1)"));
}

TEST(Metrics, ALostSourceIsNotUp) {
  Metrics metrics;
  EXPECT_TRUE(has_line(metrics.text(), "cie_live_up 0"));
  auto s = snapshot();
  for (const auto state : {SourceState::lost, SourceState::ended}) {
    s.state = state;
    metrics.add(s);
    EXPECT_TRUE(has_line(metrics.text(), "cie_live_up 0"));
  }
}

TEST(Metrics, SayWhichMachinesAreHeardOf) {
  Metrics metrics;
  Snapshot snapshot;
  snapshot.sequence = 1;
  metrics.add(snapshot);
  EXPECT_EQ(metrics.text().find("cie_live_host_up"), std::string::npos) << "there is one session";
  for (const auto state : {SourceState::streaming, SourceState::silent, SourceState::ended}) {
    snapshot.hosts.emplace_back();
    snapshot.hosts.back().host = std::string(label(state));
    snapshot.hosts.back().session = "s";
    snapshot.hosts.back().state = state;
  }
  metrics.add(snapshot);
  const auto text = metrics.text();
  EXPECT_TRUE(has_line(text, "cie_live_host_up{host=\"streaming\",session=\"s\"} 1"));
  EXPECT_TRUE(has_line(text, "cie_live_host_up{host=\"silent\",session=\"s\"} 0"));
  EXPECT_TRUE(has_line(text, "cie_live_host_up{host=\"ended\",session=\"s\"} 0"));
}

}  // namespace
}  // namespace cie::live
