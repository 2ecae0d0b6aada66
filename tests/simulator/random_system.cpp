#include "simulator/random_system.hpp"

#include "random.hpp"

#include <algorithm>
#include <ostream>
#include <string>

namespace cie::sim {
namespace {

constexpr Ns kMicrosecond = 1'000;
constexpr Ns kMillisecond = 1'000'000;

class Builder {
 public:
  explicit Builder(const Shape& shape) : shape_(shape), random_(shape.seed) {}

  System build() {
    system_.cpus = shape_.cpus;
    system_.processes = shape_.processes;
    system_.mutexes = shape_.mutexes;
    system_.duration = 20 * kMillisecond;
    system_.seed = random_.next();
    system_.receiver.policy = Policy::other;
    if (shape_.has_policies) {
      system_.receiver.policy = Policy::fifo;
      system_.receiver.priority = 90;
    }
    add_callbacks();
    add_servers();
    for (int i = 0; i < shape_.loads; ++i)
      add_load();
    return std::move(system_);
  }

 private:
  // What one of all callbacks and loads may compute per period to reach the utilization.
  Range share(Ns period) {
    const auto users = shape_.timers + shape_.subscriptions + shape_.loads;
    const auto mean = period * shape_.utilization * shape_.cpus / (100 * std::max(users, 1));
    return {.least = mean / 4, .most = mean * 7 / 4};
  }

  ThreadParameters parameters(Ns period) {
    ThreadParameters drawn;
    drawn.policy = Policy::other;
    const auto policy = shape_.has_policies ? random_.between(0, 3) : 0;
    if (policy == 1) drawn.policy = Policy::fifo;
    if (policy == 2) drawn.policy = Policy::round_robin;
    if (policy == 1 || policy == 2) {
      drawn.priority = static_cast<std::uint32_t>(random_.between(1, 60));
    }
    if (policy == 0) drawn.nice = static_cast<std::int32_t>(random_.between(-20, 19));
    if (policy == 3) {
      drawn.policy = Policy::deadline;
      drawn.runtime_ns = static_cast<std::uint64_t>(std::max<Ns>(2 * share(period).most, 20'000));
      drawn.deadline_ns = std::max(static_cast<std::uint64_t>(period), drawn.runtime_ns);
      drawn.period_ns = drawn.deadline_ns;
    } else if (random_.one_in(2)) {
      drawn.cpus.emplace();
      for (int cpu = 0; cpu < shape_.cpus; ++cpu) {
        if (random_.one_in(2)) drawn.cpus->push_back(static_cast<std::uint32_t>(cpu));
      }
      if (drawn.cpus->empty()) drawn.cpus.reset();
    }
    return drawn;
  }

  std::vector<Step> steps(Ns period) {
    const auto whole = share(period);
    const Range third{.least = whole.least / 3, .most = whole.most / 3};
    std::vector<Step> steps{Compute{third}};
    if (shape_.mutexes > 0 && random_.one_in(2)) {
      const auto mutex = static_cast<int>(random_.between(0, shape_.mutexes - 1));
      steps.insert(steps.end(), {Lock{mutex}, Compute{third}, Unlock{mutex}});
    }
    if (random_.one_in(4)) steps.push_back(Sleep{{.least = 1, .most = period / 10}});
    steps.push_back(Compute{third});
    return steps;
  }

  void add_callbacks() {
    const auto count = shape_.timers + shape_.subscriptions;
    for (int i = 0; i < count; ++i) {
      Callback callback;
      callback.process = static_cast<int>(random_.between(0, shape_.processes - 1));
      // A subscription takes a topic that an earlier callback publishes: chains, no cycles.
      const bool is_timer = i < shape_.timers || system_.topics.empty();
      const auto period = random_.between(kMillisecond / 2, 4 * kMillisecond);
      periods_.push_back(period);
      const auto node = "/n" + std::to_string(callback.process);
      if (is_timer) {
        callback.period = period;
        callback.phase = random_.between(kMicrosecond, period);
      } else {
        callback.kind = CallbackKind::subscription;
        callback.topic =
            static_cast<int>(random_.between(0, static_cast<Ns>(system_.topics.size()) - 1));
        callback.depth = static_cast<std::size_t>(random_.between(1, 10));
      }
      callback.id = node + "@C" + std::to_string(i);
      callback.deadline = random_.one_in(2) ? 100 * kMillisecond : 0;
      if (shape_.is_vague) callback.tells_release = random_.one_in(2);
      if (shape_.is_vague) callback.tells_source = random_.one_in(2);
      callback.steps = steps(period);
      const auto sent = random_.between(0, 2);
      for (Ns k = 0; k < sent; ++k)
        add_topic(i, callback.steps);
      system_.callbacks.push_back(callback);
    }
  }

  void add_topic(int callback, std::vector<Step>& steps) {
    const bool is_again = !system_.topics.empty() && random_.one_in(4);
    const auto last = static_cast<int>(system_.topics.size());
    if (!is_again || topic_owner_ != callback) {
      system_.topics.push_back({.name = "/t" + std::to_string(last),
                                .is_local = random_.one_in(2),
                                .transport = {.least = 500, .most = 60 * kMicrosecond}});
      topic_owner_ = callback;
    }
    steps.push_back(Send{static_cast<int>(system_.topics.size()) - 1});
    if (random_.one_in(2)) steps.push_back(Compute{{.least = 0, .most = 10 * kMicrosecond}});
  }

  void add_servers() {
    const auto count = static_cast<int>(system_.callbacks.size());
    if (shape_.pool == 0) {
      for (int i = 0; i < count; ++i) {
        system_.servers.push_back(
            {.name = "cb" + std::to_string(i),
             .process = system_.callbacks[static_cast<std::size_t>(i)].process,
             .is_isolated = true,
             .callbacks = {i},
             .parameters = parameters(periods_[static_cast<std::size_t>(i)])});
      }
      return;
    }
    for (int process = 0; process < shape_.processes; ++process) {
      Server server{.name = "pool", .process = process, .is_isolated = false};
      for (int i = 0; i < count; ++i) {
        auto& callback = system_.callbacks[static_cast<std::size_t>(i)];
        if (callback.process != process) continue;
        server.callbacks.push_back(i);
        if (!shape_.is_reentrant) continue;
        callback.group = static_cast<int>(system_.groups.size());
        system_.groups.push_back({.process = process, .is_reentrant = true});
      }
      if (server.callbacks.empty()) continue;
      for (int i = 0; i < shape_.pool; ++i) {
        server.parameters = parameters(kMillisecond);
        system_.servers.push_back(server);
      }
    }
  }

  void add_load() {
    const auto period = random_.between(kMillisecond / 4, 3 * kMillisecond);
    system_.loads.push_back(
        {.parameters = parameters(period), .period = period, .steps = steps(period)});
  }

  const Shape& shape_;
  Random random_;
  System system_;
  std::vector<Ns> periods_;
  int topic_owner_ = -1;
};

rc::Gen<int> up_to(int least, int most) { return rc::gen::inRange(least, most + 1); }

}  // namespace

void showValue(const Shape& shape, std::ostream& out) {
  out << shape.cpus << " cpus, " << shape.processes << " processes, " << shape.timers << " timers, "
      << shape.subscriptions << " subscriptions, " << shape.loads << " loads, " << shape.mutexes
      << " mutexes, pool of " << shape.pool << (shape.is_reentrant ? ", reentrant" : "")
      << (shape.is_vague ? ", vague" : "") << (shape.has_policies ? "" : ", SCHED_OTHER") << ", "
      << shape.utilization << " %, seed " << shape.seed;
}

rc::Gen<Shape> shapes() {
  return rc::gen::build<Shape>(
      rc::gen::set(&Shape::cpus, up_to(1, 4)), rc::gen::set(&Shape::processes, up_to(1, 2)),
      rc::gen::set(&Shape::timers, up_to(1, 3)), rc::gen::set(&Shape::subscriptions, up_to(0, 4)),
      rc::gen::set(&Shape::loads, up_to(0, 3)), rc::gen::set(&Shape::mutexes, up_to(0, 2)),
      rc::gen::set(&Shape::pool,
                   rc::gen::map(up_to(0, 5), [](int n) { return n > 3 ? n - 2 : 0; })),
      rc::gen::set(&Shape::utilization, up_to(5, 150)), rc::gen::set(&Shape::is_reentrant),
      rc::gen::set(&Shape::is_vague), rc::gen::set(&Shape::has_policies),
      rc::gen::set(&Shape::seed, rc::gen::noShrink(rc::gen::arbitrary<std::uint64_t>())));
}

rc::Gen<Shape> calm_shapes() {
  return rc::gen::build<Shape>(
      rc::gen::set(&Shape::cpus, up_to(2, 4)), rc::gen::set(&Shape::processes, up_to(1, 2)),
      rc::gen::set(&Shape::timers, up_to(1, 3)), rc::gen::set(&Shape::subscriptions, up_to(0, 3)),
      rc::gen::set(&Shape::loads, up_to(0, 1)), rc::gen::set(&Shape::mutexes, up_to(0, 2)),
      rc::gen::set(&Shape::utilization, up_to(2, 12)),
      rc::gen::set(&Shape::seed, rc::gen::noShrink(rc::gen::arbitrary<std::uint64_t>())));
}

System system_of(const Shape& shape) { return Builder(shape).build(); }

}  // namespace cie::sim
