// What verify and the report's rows cost grows as the facts do: nothing holds every callback or thread
// against every other one.
#include "model/loss_gaps.hpp"
#include "report/callback_report.hpp"
#include "rules/rule.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <limits>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <malloc.h>

namespace cie::test {
namespace {

using namespace analysis;

EventRef event_at(std::int64_t ns) { return {.time = {ns}, .cpu = 0, .pid = 1, .tid = 1}; }

// One process of which nothing is proven, because a loss may have taken the end of anything.
std::unique_ptr<Model> lossy_process() {
  auto model = std::make_unique<Model>();
  model->hosts.emplace_back();
  auto& process = model->processes.emplace_back();
  process.has_cie_events = true;
  process.pid = 1;
  process.first_seen = process.run_begin = event_at(0);
  process.last_seen = event_at(1'000'000'000);
  process.first_moment = RunMoment::start;
  model->events.by_name["callback_start"] = 1;
  model->begin = Timestamp{0};
  model->end = Timestamp{2'000'000'000};
  Loss loss;
  loss.domain = Domain::user;
  loss.begin = Timestamp{0};
  loss.end = Timestamp{2'000'000'000};
  model->losses.push_back(loss);
  model->gaps.add(gap_of(loss, 0));
  return model;
}

CallbackIndex add_callback(Model& model, GroupIndex group, bool is_registered = true) {
  const auto number = static_cast<std::uint32_t>(model.callbacks.size());
  auto& callback = model.callbacks.emplace_back();
  callback.id = CallbackId{number};
  callback.logical_id = "/node@Timer(" + std::to_string(number) + ")";
  callback.kind = CallbackKind::timer;
  callback.group = model.groups[at(group)].id;
  if (!is_registered) return CallbackIndex{number};
  callback.registered = event_at(number);
  model.groups[at(group)].callbacks.push_back(CallbackIndex{number});
  return CallbackIndex{number};
}

GroupIndex add_group(Model& model) {
  const auto number = static_cast<std::uint32_t>(model.groups.size());
  auto& group = model.groups.emplace_back();
  group.id = GroupId{number};
  group.type = GroupType::mutually_exclusive;
  group.first_seen = event_at(number);
  return GroupIndex{number};
}

ThreadIndex add_thread(Model& model, ThreadRole role) {
  const auto number = static_cast<std::uint32_t>(model.threads.size());
  auto& thread = model.threads.emplace_back();
  thread.tid = 1000 + number;
  thread.announced = event_at(number);
  thread.role = role;
  return ThreadIndex{number};
}

// It starts there at that time, and never ends.
void run(Model& model, CallbackIndex callback, ThreadIndex thread, std::int64_t ns) {
  auto& facts = model.callbacks[at(callback)];
  auto& pair = model.pairs.emplace_back();
  pair.callback = callback;
  pair.thread = thread;
  pair.starts = 1;
  pair.is_certain = true;
  pair.first_start = pair.last_activity = event_at(ns);
  pair.first_seq = facts.starts.count;
  facts.ran_on.push_back(&pair);
  model.threads[at(thread)].ran.push_back(&pair);
  if (!facts.starts.first) facts.starts.first_at = pair.first_start;
  facts.starts.first = 0;
  facts.starts.last = facts.starts.count++;
  facts.starts.last_at = pair.first_start;
}

// Each callback on an isolated thread, in a group of its own.
std::unique_ptr<Model> isolated_callbacks(std::uint32_t count) {
  auto model = lossy_process();
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto group = add_group(*model);
    const auto callback = add_callback(*model, group);
    const auto thread = add_thread(*model, ThreadRole::callback);
    model->threads[at(thread)].callback = model->callbacks[at(callback)].id;
    model->threads[at(thread)].group = model->groups[at(group)].id;
    run(*model, callback, thread, 1'000'000 + i);
  }
  return model;
}

// The same, all in one group.
std::unique_ptr<Model> callbacks_of_one_group(std::uint32_t count) {
  auto model = lossy_process();
  const auto group = add_group(*model);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto callback = add_callback(*model, group);
    const auto thread = add_thread(*model, ThreadRole::callback);
    model->threads[at(thread)].callback = model->callbacks[at(callback)].id;
    model->threads[at(thread)].group = GroupId{0};
    run(*model, callback, thread, 1'000'000 + i);
  }
  return model;
}

// Threads that run all callbacks, and end in order.
template <std::size_t Threads>
std::unique_ptr<Model> callbacks_of_a_pool(std::uint32_t count) {
  auto model = lossy_process();
  std::array<ThreadIndex, Threads> threads{};
  for (auto& thread : threads)
    thread = add_thread(*model, ThreadRole::pool);
  const auto group = add_group(*model);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto callback = add_callback(*model, group);
    for (const auto thread : threads)
      run(*model, callback, thread, 1'000'000 + i);
  }
  return model;
}

// One callback that runs on one thread after the other; whether these have ended is not known. Of
// as many other callbacks nothing is known but that they exist.
std::unique_ptr<Model> threads_of_one_callback(std::uint32_t count) {
  auto model = lossy_process();
  const auto group = add_group(*model);
  const auto callback = add_callback(*model, group);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto thread = add_thread(*model, ThreadRole::pool);
    auto& facts = model->threads[at(thread)];
    facts.announced = event_at(1'000'000 + 10 * i);
    run(*model, callback, thread, 1'000'001 + 10 * i);
    if (i > 0 && i <= 1024) {
      Move move;
      move.from = ThreadIndex{i - 1};
      move.to = thread;
      model->callbacks[at(callback)].moves.push_back(move);
    }
    add_callback(*model, group, false);
  }
  return model;
}

// The last callback of one thread after the other, in a process whose end was seen.
std::unique_ptr<Model> threads_without_end(std::uint32_t count) {
  auto model = threads_of_one_callback(count);
  model->processes.front().run_end = RunTotals{.at = event_at(2'000'000'000)};
  return model;
}

// Threads that ran nothing, beside callbacks that lost instances.
std::unique_ptr<Model> idle_threads(std::uint32_t count) {
  auto model = isolated_callbacks(count);
  for (std::uint32_t i = 0; i < count; ++i)
    add_thread(*model, ThreadRole::pool);
  return model;
}

// Of another executor, on one thread of a process that tells of all its own, of which there are none.
std::unique_ptr<Model> callbacks_of_another_executor(std::uint32_t count) {
  auto model = lossy_process();
  model->losses.clear();
  model->processes.front().run_end = RunTotals{.at = event_at(2'000'000'000)};
  const auto group = add_group(*model);
  const auto thread = add_thread(*model, ThreadRole::pool);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto callback = add_callback(*model, group);
    model->callbacks[at(callback)].is_accounted = false;
    run(*model, callback, thread, 1'000'000 + i);
  }
  return model;
}

std::int64_t processor_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

// The least of several: the first one makes the heap as large as it has to be, which costs what the machine
// makes of page faults.
std::int64_t cost_of(const auto& work) {
  auto least = std::numeric_limits<std::int64_t>::max();
  for (int i = 0; i < 3; ++i) {
    const auto begin = processor_ns();
    work();
    least = std::min(least, processor_ns() - begin);
  }
  return least;
}

std::int64_t cost_of_verify(const Model& model) {
  const AnalysisOptions options;
  return cost_of([&] { EXPECT_FALSE(verify(RuleContext(model, options)).rules.empty()); });
}

std::int64_t cost_of_rows(const Model& model) {
  const AnalysisOptions options;
  const RuleContext context(model, options);
  return cost_of([&] { EXPECT_FALSE(callback_reports(context).empty()); });
}

struct Growing {
  const char* name;
  std::unique_ptr<Model> (*make)(std::uint32_t count);
};

class Growth : public ::testing::TestWithParam<Growing> {};

TEST_P(Growth, OfTheCostIsThatOfTheFacts) {
  constexpr std::uint32_t kFew = 1'000;
  constexpr std::uint32_t kTimes = 10;
  const auto few = GetParam().make(kFew);
  const auto many = GetParam().make(kFew * kTimes);
  // What was allocated stays in the heap.
  ::mallopt(M_MMAP_MAX, 0);
  ::mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  // Sorting and caches cost some more: ten to fifteen times as much was measured, and of a rule
  // that holds each subject against every other one, forty to three hundred.
  EXPECT_LE(cost_of_verify(*many), cost_of_verify(*few) * kTimes * 5 / 2);
  EXPECT_LE(cost_of_rows(*many), cost_of_rows(*few) * kTimes * 5 / 2);
}

INSTANTIATE_TEST_SUITE_P(
    Rules, Growth,
    ::testing::Values(
        Growing{"Isolated", isolated_callbacks}, Growing{"OneGroup", callbacks_of_one_group},
        Growing{"OneThread", callbacks_of_a_pool<1>}, Growing{"Pool", callbacks_of_a_pool<2>},
        Growing{"Threads", threads_of_one_callback},
        Growing{"ThreadsWithoutEnd", threads_without_end}, Growing{"IdleThreads", idle_threads},
        Growing{"AnotherExecutor", callbacks_of_another_executor}),
    [](const ::testing::TestParamInfo<Growing>& each) { return std::string(each.param.name); });

}  // namespace
}  // namespace cie::test
