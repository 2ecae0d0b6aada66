// cie-record --kernel with a real kernel: the scheduler's events beside those of user space, what
// the analyzer makes of both, and that nothing stays behind.
#include <cie/analysis/analyzer.hpp>
#include <cie/viewer_export/sentences.hpp>

#include "ctf/stream_check.hpp"
#include "kernel/kernel_source.hpp"
#include "kernel/tracefs.hpp"
#include "sandbox.hpp"
#include "system/error.hpp"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using record::Tracefs;
using ::testing::HasSubstr;

std::vector<std::string> instances_of_recorders(const Tracefs& tracefs) {
  std::vector<std::string> names;
  for (const std::string& name : tracefs.list("instances")) {
    if (name.starts_with("cie-record-")) names.push_back(name);
  }
  return names;
}

class MachineWithKernelTracing : public ::testing::Test {
 protected:
  void SetUp() override {
    if (geteuid() != 0) {
      GTEST_SKIP() << "not possible here: the kernel's tracing is for root";
    }
    try {
      tracefs_.emplace();
    } catch (const record::KernelUnavailable& error) {
      GTEST_SKIP() << "not possible here: " << error.what();
    }
    if (!sandbox_.skip_reason().empty()) GTEST_SKIP() << sandbox_.skip_reason();
  }

  fs::path path(const std::string& name) const { return sandbox_.directory() / name; }

  json manifest() const { return json::parse(read_file(path("rec/manifest.json"))); }

  // What babeltrace2 prints of a part of the recording; it must be able to read all of it.
  std::string babeltrace2(const std::vector<std::string>& arguments) {
    std::vector<std::string> command{"babeltrace2"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const Finished result = sandbox_.run(command);
    EXPECT_EQ(result.status, 0) << result.err;
    return result.out + result.err;
  }

  // The line of a trace's metadata that gives its clock's offset or uuid.
  std::string clock_line(const std::string& trace, const std::string& name) {
    const std::string text = babeltrace2({"--output-format=ctf-metadata", path("rec") / trace});
    const std::size_t clock = text.find("clock {");
    const std::size_t begin = text.find('\t' + name + " = ", clock);
    return text.substr(begin, text.find('\n', begin) - begin);
  }

  std::string user_trace() const {
    for (const auto& entry : fs::recursive_directory_iterator(path("rec/ust"))) {
      if (entry.path().filename() == "metadata") {
        return entry.path().parent_path().lexically_relative(path("rec"));
      }
    }
    return {};
  }

  pid_t wait_until_ready() const {
    EXPECT_TRUE(eventually([&] { return fs::exists(path("pid")); })) << "the application hangs";
    return static_cast<pid_t>(std::stoi(read_file(path("pid"))));
  }

  Sandbox sandbox_{User::current};
  std::optional<Tracefs> tracefs_;
};

// By each of the routes.
class KernelRecord : public MachineWithKernelTracing,
                     public ::testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    MachineWithKernelTracing::SetUp();
    if (IsSkipped() || !is_bpf()) return;
    try {
      record::open_bpf_source(64 << 10);
    } catch (const record::KernelUnavailable& error) {
      GTEST_SKIP() << "not possible here: " << error.what();
    }
  }

  static bool is_bpf() { return std::string(GetParam()) == "bpf"; }

  static std::vector<std::string> recording(const std::vector<std::string>& arguments,
                                            const std::vector<std::string>& options = {}) {
    std::vector<std::string> command{CIE_RECORD, "-o", "rec",
                                     std::string("--kernel=") + GetParam()};
    command.insert(command.end(), options.begin(), options.end());
    command.insert(command.end(), {"--", CIE_TRACED_APP});
    command.insert(command.end(), arguments.begin(), arguments.end());
    return command;
  }
};

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

TEST_P(KernelRecord, TellsSwitchesOnTheClockOfUserSpace) {
  const Finished result = sandbox_.run(recording({"--instances", "100"}));
  ASSERT_EQ(result.status, 0) << result.err;
  const json recorded = manifest();
  EXPECT_EQ(recorded["kernel_events"], true);
  EXPECT_EQ(recorded["kernel"]["route"], GetParam());
  EXPECT_EQ(recorded["kernel"]["lost_events"], 0);
  const auto events = recorded["kernel"]["events"].get<std::uint64_t>();
  EXPECT_THAT(result.err,
              HasSubstr("kernel events: " + std::to_string(events) + " by " + GetParam() + ')'));

  const std::string kernel = babeltrace2({path("rec/kernel")});
  EXPECT_EQ(count_of(kernel, "\n"), events);
  EXPECT_GT(count_of(kernel, "sched_switch: "), 0U);
  EXPECT_GT(count_of(kernel, "sched_waking: "), 0U);
  EXPECT_GT(count_of(kernel, "sched_process_fork: "), 0U);
  EXPECT_GT(count_of(kernel, "sched_process_exit: "), 0U);
  EXPECT_GT(count_of(kernel, "sched_process_exec: "), 0U) << "the command's own";
  const std::string user = user_trace();
  for (const char* name : {"offset", "uuid"}) {
    EXPECT_EQ(clock_line("kernel", name), clock_line(user, name));
  }
  const std::string both = babeltrace2({path("rec")});
  EXPECT_EQ(count_of(both, "\n"), events + count_of(babeltrace2({path("rec") / user}), "\n"));
  // The first event is the kernel's: no instance began before its record did.
  EXPECT_THAT(both.substr(0, both.find('\n')), HasSubstr(" sched_"));
}

// By the first thread and by another one, which is called like the first one from then on.
TEST_P(KernelRecord, TellsAProgramThatIsExecutedFromACrash) {
  for (const std::string leave_by : {"exec", "exec-elsewhere"}) {
    fs::remove_all(path("rec"));
    ASSERT_EQ(sandbox_.run(recording({"--leave-by", leave_by})).status, 0);
    const std::vector<fs::path> traces{path("rec")};
    std::string told;
    for (const auto& rule : analysis::analyze(traces, {}).verdicts.rules) {
      if (rule.id != "T4") continue;
      for (const auto& subject : rule.subjects) {
        for (const auto& evidence : subject.evidence)
          told += viewer_export::sentence(evidence.note) + '\n';
      }
    }
    EXPECT_THAT(told, HasSubstr("the process executed another program here")) << leave_by;
  }
}

// Collects what the analyzer says of each instance.
class Instances : public analysis::Observer {
 public:
  void on_instance(const analysis::Instance& instance) override { all.push_back(instance); }
  std::vector<analysis::Instance> all;
};

TEST_P(KernelRecord, PartsOfEveryInstanceAddUpToItsDurationUnderLoad) {
  const std::int64_t cpus = sysconf(_SC_NPROCESSORS_ONLN);
  std::vector<Running> load;
  for (std::int64_t i = 0; i < cpus + 1; ++i) {
    load.push_back(sandbox_.start({"sh", "-c", "while :; do :; done"}));
  }
  const Finished result =
      sandbox_.run(recording({"--instances", "200", "--work-us", "2000", "--period-us", "500"}));
  load.clear();
  ASSERT_EQ(result.status, 0) << result.err;

  const std::vector<fs::path> traces{path("rec")};
  Instances instances;
  const auto analyzed = analysis::analyze(traces, {}, &instances);
  std::size_t complete = 0;
  std::size_t measured = 0;
  std::size_t preempted = 0;
  std::vector<std::int64_t> executions;
  for (const analysis::Instance& instance : instances.all) {
    if (instance.state != analysis::InstanceState::complete) continue;
    ++complete;
    if (!instance.execution || !instance.blocked || !instance.wake_delay) continue;
    ++measured;
    if (instance.preempted->ns > 0) ++preempted;
    EXPECT_EQ(
        (*instance.execution + *instance.preempted + *instance.blocked + *instance.wake_delay).ns,
        (*instance.end - instance.start).ns);
    for (const auto part :
         {*instance.execution, *instance.preempted, *instance.blocked, *instance.wake_delay}) {
      EXPECT_GE(part.ns, 0);
    }
    if (instance.logical_id == "/test/node@Timer(1000000)") {
      executions.push_back(instance.execution->ns);
    }
  }
  // What its thread saw itself use. The kernel's account of that begins and ends microseconds, or a
  // host's whim, away from the switches.
  std::ranges::sort(executions);
  if (!executions.empty()) {
    EXPECT_GE(executions[executions.size() / 2], 1'980'000);
  }
  EXPECT_EQ(complete, 400U);
  const json kernel = manifest()["kernel"];
  if (kernel["untold_switches"] == 0 && kernel["lost_events"] == 0) {
    EXPECT_EQ(measured, complete);
  }

  // How well the trace agrees with the kernel's own account. Not asserted: the account leaves out
  // interrupts and time stolen from a virtual machine, which differ by machine.
  const std::size_t at = result.out.find("thread ");
  ASSERT_NE(at, std::string::npos) << result.out;
  const std::int64_t tid = std::stoll(result.out.substr(at + 7));
  const std::int64_t used = std::stoll(result.out.substr(result.out.find("used ", at) + 5));
  for (const auto& thread : analyzed.report.threads) {
    if (thread.tid != tid) continue;
    // A hole between two instances takes no more than the busy time.
    EXPECT_TRUE(thread.busy_ns || measured < complete || kernel["untold_switches"] != 0);
    std::cout << "measured " << measured << " of " << complete << " instances, " << preempted
              << " of them preempted; thread: trace " << thread.busy_ns.value_or(-1)
              << " ns, clock " << used << " ns; switches not told " << kernel["untold_switches"]
              << '\n';
  }
}

// Holes, which some virtual machines have always, cost execution times and no verdict.
TEST_F(MachineWithKernelTracing, AutomaticallyKeepsTheRecordWithHolesOrWithout) {
  const Finished result = sandbox_.run({CIE_RECORD, "-o", "rec", "--", CIE_TRACED_APP});
  ASSERT_EQ(result.status, 0) << result.err;
  const json recorded = manifest();
  EXPECT_TRUE(recorded["kernel_events"].get<bool>());
  EXPECT_THAT(babeltrace2({path("rec")}), HasSubstr("sched_switch: "));
  EXPECT_EQ(count_of(babeltrace2({path("rec")}), "cie:run_begin: "), 1U);

  const std::vector<fs::path> traces{path("rec")};
  Instances instances;
  for (const auto& rule : analysis::analyze(traces, {}, &instances).verdicts.rules)
    EXPECT_NE(rule.verdict, analysis::Verdict::inconclusive) << rule.id;
  EXPECT_TRUE(std::ranges::any_of(instances.all, [](const analysis::Instance& instance) {
    return instance.execution && instance.preempted && instance.blocked && instance.wake_delay;
  }));
}

TEST_P(KernelRecord, CountsWhatWasLostBeforeItWasRead) {
  Running recorder = sandbox_.start(recording(
      {"--until-signal", "--period-us", "50", "--ready", path("pid")}, {"--kernel-buffer=64k"}));
  const pid_t application = wait_until_ready();
  recorder.signal(SIGSTOP);
  // An instance sleeps once, and each switch takes more than 30 bytes: far more than all buffers.
  const std::int64_t enough = 5'000 * sysconf(_SC_NPROCESSORS_ONLN);
  const std::int64_t before = sleeps_of(application);
  ASSERT_TRUE(eventually([&] { return sleeps_of(application) > before + enough; }));
  recorder.signal(SIGCONT);
  usleep(300'000);
  kill(application, SIGTERM);
  const Finished result = recorder.wait();
  ASSERT_EQ(result.status, 0) << result.err;
  const json kernel = manifest()["kernel"];
  const auto lost = kernel["lost_events"].get<std::uint64_t>();
  EXPECT_GT(lost, 0U);
  EXPECT_THAT(result.err, HasSubstr("LOST: the kernel's buffers lost " + std::to_string(lost)));

  // The trace says the same: the sum of what each stream's packets count as discarded.
  const std::vector<fs::path> traces{path("rec/kernel")};
  const auto report = analysis::analyze(traces, {}).report;
  EXPECT_EQ(report.trace.lost_events, lost);
}

TEST_P(KernelRecord, LeavesTheMachinesTracingAsItWas) {
  const std::vector<std::string> settings{"tracing_on",     "trace_clock",    "set_event",
                                          "current_tracer", "buffer_size_kb", "set_event_pid"};
  const auto read_settings = [&] {
    std::map<std::string, std::string> values;
    for (const std::string& setting : settings) {
      values[setting] = tracefs_->read(setting);
    }
    return values;
  };
  const auto before = read_settings();
  const auto others = instances_of_recorders(*tracefs_);
  Running recorder = sandbox_.start(recording({"--until-signal", "--ready", path("pid")}));
  const pid_t application = wait_until_ready();
  EXPECT_EQ(read_settings(), before);
  const std::string own = '-' + std::to_string(recorder.pid()) + '-';
  const auto has_own = [&] {
    for (const std::string& name : instances_of_recorders(*tracefs_)) {
      if (name.find(own) != std::string::npos) return true;
    }
    return false;
  };
  EXPECT_EQ(has_own(), !is_bpf());
  kill(application, SIGTERM);
  ASSERT_EQ(recorder.wait().status, 0);
  EXPECT_EQ(read_settings(), before);
  EXPECT_FALSE(has_own());
}

TEST_P(KernelRecord, WhatAKilledRecorderLeavesIsReadableAndGoneWithTheNext) {
  Running recorder = sandbox_.start(
      recording({"--until-signal", "--ready", path("pid")}, {"--flush-interval", "50"}));
  const pid_t application = wait_until_ready();
  // Whole packets: libbabeltrace2 reads nothing of a file whose last packet is cut, so no write may
  // be under way.
  const auto is_whole = [&] {
    recorder.signal(SIGSTOP);
    int status = 0;
    waitpid(recorder.pid(), &status, WUNTRACED);
    const auto streams = record::check_streams(path("rec/kernel"));
    const bool is_cut =
        std::ranges::any_of(streams, [](const auto& stream) { return stream.is_damaged; });
    const bool is_empty =
        std::ranges::all_of(streams, [](const auto& stream) { return stream.packets == 0; });
    if (is_cut || is_empty) recorder.signal(SIGCONT);
    return !is_cut && !is_empty;
  };
  ASSERT_TRUE(eventually(is_whole));
  const std::string own = '-' + std::to_string(recorder.pid()) + '-';
  recorder.signal(SIGKILL);
  recorder.wait();
  kill(application, SIGKILL);
  const auto left = [&] {
    std::vector<std::string> names;
    for (const std::string& name : instances_of_recorders(*tracefs_)) {
      if (name.find(own) != std::string::npos) names.push_back(name);
    }
    return names;
  };
  ASSERT_EQ(left().size(), is_bpf() ? 0U : 1U);
  EXPECT_THAT(babeltrace2({path("rec/kernel")}), HasSubstr("sched_switch: "));

  // Not ours, though it looks alike: a process of another pid namespace may still use it.
  // Both routes' tests may run at once.
  const std::string foreign = std::string("instances/cie-record-1-1-") + (is_bpf() ? '1' : '2');
  tracefs_->make_directory(foreign);
  EXPECT_EQ(sandbox_.run({CIE_RECORD, "-o", "next", "--", CIE_TRACED_APP}).status, 0);
  EXPECT_TRUE(left().empty());
  EXPECT_TRUE(tracefs_->remove_directory(foreign));
}

INSTANTIATE_TEST_SUITE_P(Routes, KernelRecord, ::testing::Values("bpf", "tracefs"),
                         [](const auto& route) { return std::string(route.param); });

TEST(KernelRecordForOrdinaryUsers, SaysInOneLineWhyItCannot) {
  if (geteuid() != 0) {
    GTEST_SKIP() << "not possible here: only root can become an ordinary user";
  }
  Sandbox sandbox(User::ordinary);
  if (!sandbox.skip_reason().empty()) GTEST_SKIP() << sandbox.skip_reason();
  const Finished refused =
      sandbox.run({CIE_RECORD, "-o", "rec", "--kernel=yes", "--", CIE_TRACED_APP});
  EXPECT_EQ(refused.status, 4);
  EXPECT_THAT(refused.err, HasSubstr("--kernel=yes: the kernel's tracing is for root"));
  EXPECT_EQ(count_of(refused.err, "\n"), 1U) << refused.err;
  EXPECT_FALSE(fs::exists(sandbox.directory() / "rec"));

  const Finished done = sandbox.run({CIE_RECORD, "-o", "rec", "--", CIE_TRACED_APP});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("kernel events: no, the kernel's tracing is for root"));
  const json manifest = json::parse(read_file(sandbox.directory() / "rec/manifest.json"));
  EXPECT_EQ(manifest["kernel_events"], false);
  EXPECT_THAT(manifest["kernel"]["reason"].get<std::string>(), HasSubstr("root"));
  EXPECT_FALSE(fs::exists(sandbox.directory() / "rec/kernel"));
}

}  // namespace
}  // namespace cie::test
