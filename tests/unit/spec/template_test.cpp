#include <cie/tracepoints/scheduling_spec.hpp>

#include "spec_template.hpp"

#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::cli {
namespace {

using analysis::CallbackReport;
using analysis::Report;
using analysis::ThreadReport;
using analysis::ThreadSchedReport;
using testing::HasSubstr;
using testing::Not;

// A report in which each callback ran on the thread `tid`.
class Template : public testing::Test {
 protected:
  CallbackReport& callback(const std::string& id, std::int64_t tid, std::int64_t pid = 1) {
    CallbackReport callback;
    callback.logical_id = id;
    callback.process = process(pid);
    callback.instances = 1;
    for (ThreadReport& thread : report_.threads) {
      if (thread.tid != tid || thread.process != callback.process) continue;
      callback.threads.push_back({.thread = thread.index, .tid = tid, .name = {}, .instances = 1});
      thread.callbacks.push_back(id);
    }
    report_.callbacks.push_back(callback);
    return report_.callbacks.back();
  }
  void thread(std::int64_t tid, const std::optional<ThreadSchedReport>& sched,
              const std::string& name = "t", ThreadRole role = ThreadRole::callback,
              std::int64_t pid = 1) {
    ThreadReport thread;
    thread.index = analysis::ThreadIndex{static_cast<std::uint32_t>(report_.threads.size())};
    thread.process = process(pid);
    thread.tid = tid;
    thread.name = name;
    thread.role = role;
    thread.sched = sched;
    report_.threads.push_back(thread);
  }
  static analysis::ProcessIndex process(std::int64_t pid) {
    return analysis::ProcessIndex{static_cast<std::uint32_t>(pid)};
  }
  static ThreadSchedReport sched(Policy policy) {
    ThreadSchedReport sched;
    sched.policy = static_cast<std::int32_t>(policy);
    sched.cpus = {0, 1};
    return sched;
  }
  std::string text() const {
    std::ostringstream stream;
    write_spec_template(stream, report_);
    return stream.str();
  }
  // As the executor and the verifier would read it.
  SchedulingSpec spec() const { return SchedulingSpec::parse(text(), "template.yaml"); }

  Report report_;
};

// Of one of two instances the release is not known: it took 7 from its start.
TEST_F(Template, SaysOfBoundsThatTheyAre) {
  const auto all = [](std::int64_t value) {
    analysis::Summary summary;
    summary.count = 1;
    summary.min = summary.max = value;
    return summary;
  };
  thread(1, sched(Policy::other));
  auto& bounded = callback("/a@Timer(1)", 1);
  bounded.response_time = all(5);
  bounded.inter_arrival = all(9);
  EXPECT_THAT(text(), HasSubstr("; response time at most 5;"));
  EXPECT_THAT(text(), HasSubstr("; inter-arrival time at least 9 and at most 9\n"));
  bounded.response_time_lower = all(7);
  EXPECT_THAT(text(), HasSubstr("; longest response time at least 7;"));
  EXPECT_THAT(text(), HasSubstr("; inter-arrival time at least 9 and at most 9 where releases are "
                                "known\n"));
}

// Whoever takes it for a wcet has to know.
TEST_F(Template, SaysOfHowManyInstancesTheExecutionTimeIsKnown) {
  thread(11, sched(Policy::other));
  auto& whole = callback("a", 11);
  whole.instances = 3;
  whole.execution_time = analysis::Summary{.count = 3, .max = 9};
  EXPECT_THAT(text(), HasSubstr("seen: 3 instances; execution time at most 9\n"));
  report_.callbacks[0].execution_time->count = 2;
  EXPECT_THAT(text(),
              HasSubstr("seen: 3 instances; execution time at most 9 of 2 of 3 measured\n"));
}

TEST_F(Template, OfNothingIsASpec) { EXPECT_TRUE(spec().callbacks().empty()); }

TEST_F(Template, AsksForWhatWasReadBack) {
  auto fifo = sched(Policy::fifo);
  fifo.priority = 80;
  auto other = sched(Policy::other);
  other.nice = -7;
  auto deadline = sched(Policy::deadline);
  deadline.runtime_ns = 2000;
  deadline.deadline_ns = 3000;
  deadline.period_ns = 4000;
  thread(1, fifo);
  thread(2, other);
  thread(3, deadline);
  thread(4, sched(Policy::idle));
  for (const std::int64_t tid : {1, 2, 3, 4})
    callback("/n@Timer(" + std::to_string(tid) + ")", tid);
  const auto read = spec();
  const auto parameters = [&read](const char* id) { return read.find_callback(id)->parameters; };
  EXPECT_EQ(parameters("/n@Timer(1)").policy, Policy::fifo);
  EXPECT_EQ(parameters("/n@Timer(1)").priority, 80U);
  EXPECT_EQ(*parameters("/n@Timer(1)").cpus, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(parameters("/n@Timer(2)").nice, -7);
  EXPECT_EQ(parameters("/n@Timer(3)").runtime_ns, 2000U);
  EXPECT_EQ(parameters("/n@Timer(3)").period_ns, 4000U);
  EXPECT_EQ(parameters("/n@Timer(4)").policy, Policy::idle);
}

TEST_F(Template, AsksForNothingThatItDidNotSee) {
  thread(1, std::nullopt);
  thread(2, sched(Policy::other));
  thread(3, sched(Policy{7}));
  thread(4, sched(Policy::deadline));  // of all zeros
  callback("/unread@Timer(1)", 1);
  callback("/shared@Timer(1)", 2);
  callback("/shared@Timer(2)", 2);
  callback("/odd@Timer(1)", 3);
  callback("/zero@Timer(1)", 4);
  callback("/nowhere@Timer(1)", 0);
  const auto read = spec();
  EXPECT_EQ(read.callbacks().size(), 6U);
  for (const SpecEntry& entry : read.callbacks()) {
    EXPECT_FALSE(entry.parameters.policy || entry.parameters.cpus) << entry.id;
  }
  EXPECT_THAT(text(), HasSubstr("# it shared a thread with other callbacks"));
  EXPECT_THAT(text(), HasSubstr("# the threads that it ran on are not in the trace"));
}

// sched_setaffinity is given a cpu_set_t, which has 1024 of them; kernels may have 8192.
TEST_F(Template, LeavesOutAnAffinityThatNoSpecCanAskForAndSaysWhy) {
  auto usable = sched(Policy::other);
  usable.cpus = {1023};
  thread(1, usable);
  auto beyond = sched(Policy::fifo);
  beyond.priority = 10;
  beyond.cpus = {3, 1024};
  thread(2, beyond);
  auto unknown = sched(Policy::other);
  unknown.cpus = {};
  thread(3, unknown);
  callback("/usable@Timer(1)", 1);
  callback("/beyond@Timer(1)", 2);
  callback("/unknown@Timer(1)", 3);
  const auto read = spec();
  ASSERT_EQ(read.callbacks().size(), 3U);
  EXPECT_EQ(read.callbacks()[0].parameters.cpus, (std::vector<std::uint32_t>{1023}));
  EXPECT_EQ(read.callbacks()[1].parameters.cpus, std::nullopt);
  EXPECT_EQ(read.callbacks()[2].parameters.cpus, std::nullopt);
  EXPECT_THAT(text(), HasSubstr("    priority: 10\n    affinity: ~\n"
                                "    # a spec has no CPUs above 1023, and it may use CPU 1024\n"));
  EXPECT_THAT(text(), HasSubstr("    affinity: ~\n    # its CPUs are not in the trace\n"));
}

// M1 fails entries of callbacks that never ran.
TEST_F(Template, HasOnlyCommentsOfWhatDidNotRun) {
  callback("/never@Timer(1)", 0).instances = 0;
  EXPECT_TRUE(spec().callbacks().empty());
  EXPECT_THAT(text(),
              HasSubstr("  # These did not run, and verify fails entries of such (M1). Uncomment "
                        "what is meant to run:\n"
                        "  # - id: \"/never@Timer(1)\"\n"
                        "  #   policy: ~\n"
                        "  #   affinity: ~\n"
                        "  #   # seen: 0 instances\n"));
  auto uncommented = text();
  for (auto at = uncommented.find("\n  # - id"); at != std::string::npos;
       at = uncommented.find("\n  #  ", at))
    uncommented.erase(at + 3, 2);
  EXPECT_EQ(SchedulingSpec::parse(uncommented, "uncommented.yaml").callbacks().size(), 1U);
}

// As ROS 2's parameter services of each node.
TEST_F(Template, HasWhatRanFirstAndSaysOnceThatTheOthersDidNot) {
  callback("/first@Timer(1)", 0).instances = 0;
  callback("/ran@Timer(1)", 0);
  callback("/last@Timer(1)", 0).instances = 0;
  const auto written = text();
  const auto remark = written.find("  # These did not run");
  EXPECT_LT(written.find("/ran@"), remark);
  EXPECT_LT(remark, written.find("/first@"));
  EXPECT_LT(written.find("/first@"), written.find("/last@"));
  EXPECT_EQ(written.find("# These did not run", remark + 10), std::string::npos);
}

TEST_F(Template, HasEntriesOfWhatRanWithoutBeingSeenWhole) {
  for (const std::string id : {"/open", "/cut", "/before"})
    callback(id, 0).instances = 0;
  report_.callbacks[0].incomplete = 1;
  report_.callbacks[1].cut = 1;
  report_.callbacks[2].runs_not_seen = 1;
  EXPECT_EQ(spec().callbacks().size(), 3U);
}

// One that ran in one lifetime need not have run in another of the same process; in each of two
// processes, which may live together, it must have.
TEST_F(Template, AsksForWhatRanInEachProcess) {
  auto fifo = sched(Policy::fifo);
  fifo.priority = 80;
  thread(1, fifo);
  callback("/again@Timer(1)", 0).instances = 0;
  callback("/again@Timer(1)", 1);
  callback("/again@Timer(1)", 0).instances = 0;
  callback("/here@Timer(1)", 0, 1);
  callback("/here@Timer(1)", 0, 2).instances = 0;
  ASSERT_TRUE(spec().find_callback("/again@Timer(1)") != nullptr);
  EXPECT_EQ(spec().find_callback("/again@Timer(1)")->parameters.priority, 80U);
  EXPECT_TRUE(spec().find_callback("/here@Timer(1)") == nullptr);
  EXPECT_THAT(text(), HasSubstr("  # It did not run in each of its processes, and"));
}

TEST_F(Template, AllowsTheMissesAndOverwritesThatWereSeen) {
  callback("/n@Subscription(/t)", 0, 1).overwritten_samples = 3;
  callback("/n@Subscription(/t)", 0, 2).overwritten_samples = 2;
  callback("/m@Subscription(/t)", 0).overwritten_samples = 0;
  EXPECT_EQ(spec().find_callback("/n@Subscription(/t)")->overwrites_allowed, 3U);
  EXPECT_FALSE(spec().find_callback("/m@Subscription(/t)")->overwrites_allowed);
}

// As S1 judges: what an audit says later is S3's.
TEST_F(Template, AsksForWhatWasApplied) {
  auto audited = sched(Policy::fifo);
  audited.priority = 20;
  thread(1, audited);
  report_.threads.back().applied = sched(Policy::fifo);
  report_.threads.back().applied->priority = 10;
  callback("/n@Timer(1)", 1);
  EXPECT_EQ(spec().find_callback("/n@Timer(1)")->parameters.priority, 10U);
}

TEST_F(Template, JoinsWhatRanInSeveralProcesses) {
  auto nice = sched(Policy::other);
  nice.nice = 3;
  thread(1, sched(Policy::other), "t", ThreadRole::callback, 1);
  thread(1, sched(Policy::other), "t", ThreadRole::callback, 2);
  callback("/same@Timer(1)", 1, 1).missed_releases = 2;
  callback("/same@Timer(1)", 1, 2).missed_releases = 5;
  thread(2, sched(Policy::other), "t", ThreadRole::callback, 1);
  thread(2, nice, "t", ThreadRole::callback, 2);
  callback("/apart@Timer(1)", 2, 1);
  callback("/apart@Timer(1)", 2, 2);
  const auto read = spec();
  EXPECT_EQ(read.callbacks().size(), 2U);
  EXPECT_EQ(read.find_callback("/same@Timer(1)")->parameters.policy, Policy::other);
  EXPECT_EQ(read.find_callback("/same@Timer(1)")->missed_releases_allowed, 5U);
  EXPECT_FALSE(read.find_callback("/apart@Timer(1)")->parameters.policy);
}

TEST_F(Template, AsksForSlicesAndClampsThatWereAskedFor) {
  auto sliced = sched(Policy::other);
  sliced.slice_ns = 300'000;
  sliced.util_min = 100;
  sliced.util_max = 700;
  auto odd = sched(Policy::other);
  odd.slice_ns = 1;  // no spec may ask for it
  odd.util_max = 1024;
  thread(1, sliced);
  thread(2, odd);
  callback("/n@Timer(1)", 1);
  callback("/n@Timer(2)", 2);
  const auto read = spec();
  const auto& parameters = read.find_callback("/n@Timer(1)")->parameters;
  EXPECT_EQ(parameters.slice_ns, 300'000U);
  EXPECT_EQ(parameters.util_min, 100U);
  EXPECT_EQ(parameters.util_max, 700U);
  EXPECT_FALSE(read.find_callback("/n@Timer(2)")->parameters.slice_ns);
  EXPECT_FALSE(read.find_callback("/n@Timer(2)")->parameters.util_max);
}

TEST_F(Template, NamesWorkersInTheirSections) {
  thread(1, sched(Policy::other), "recvUC", ThreadRole::worker);
  thread(2, sched(Policy::batch), "logger", ThreadRole::worker);
  thread(3, sched(Policy::other), "main", ThreadRole::dispatcher);
  EXPECT_THAT(text(), HasSubstr("dds_threads:\n  - name: \"recvUC\"\n"));
  EXPECT_THAT(text(), HasSubstr("non_ros_threads:\n  - name: \"logger\"\n"));
  EXPECT_EQ(spec().threads().size(), 2U);
}

// Its registration was not recorded, nor its id.
TEST_F(Template, NamesNoCallbackWithoutAnId) {
  thread(1, sched(Policy::other));
  callback("/a@Timer(1)", 1);
  callback("?7", 1);
  EXPECT_EQ(spec().callbacks().size(), 1U);
  EXPECT_THAT(text(), HasSubstr("a spec cannot name \"?7\""));
}

TEST_F(Template, SurvivesHostileNames) {
  thread(1, sched(Policy::other));
  callback("/a@Timer(1)\n  - id: evil", 1);
  callback("\xff\xfe", 0);
  callback("/b/*", 0);
  callback("", 0);
  callback("/c@Timer(\"x\\y\")", 0);
  const auto read = spec();
  ASSERT_EQ(read.callbacks().size(), 1U);
  EXPECT_EQ(read.callbacks()[0].id, "/c@Timer(\"x\\y\")");
  EXPECT_THAT(text(), Not(HasSubstr("\n  - id: evil")));
  EXPECT_THAT(text(), HasSubstr("a spec cannot name"));
}

}  // namespace
}  // namespace cie::cli
