#include "simulator/application.hpp"

#include <algorithm>
#include <utility>

namespace cie::sim {

Application::Application(const System& system, Machine& machine, Tape& tape)
    : system_(system), machine_(machine), tape_(tape) {
  number_entities();
  truth_.arrivals.resize(system_.callbacks.size());
}

void Application::number_entities() {
  processes_.resize(static_cast<std::size_t>(system_.processes));
  for (const auto& group : system_.groups) {
    auto& process = processes_[static_cast<std::size_t>(group.process)];
    groups_.push_back({.id = process.groups++,
                       .process = group.process,
                       .is_reentrant = group.is_reentrant,
                       .is_busy = false});
  }
  for (std::size_t i = 0; i < system_.callbacks.size(); ++i) {
    const auto& callback = system_.callbacks[i];
    auto& process = processes_[static_cast<std::size_t>(callback.process)];
    group_of_.push_back(callback.group >= 0 ? callback.group : static_cast<int>(groups_.size()));
    if (callback.group < 0) {
      groups_.push_back({.id = process.groups++, .process = callback.process});
    }
    auto& state = callbacks_.emplace_back();
    state.id = process.callbacks++;
    state.group = groups_[static_cast<std::size_t>(group_of_.back())].id;
    state.logical_id = tape_.keep(callback.id);
    if (callback.topic >= 0) {
      state.source = tape_.keep(system_.topics[static_cast<std::size_t>(callback.topic)].name);
    }
    for (const auto& step : callback.steps) {
      const auto* sends = std::get_if<Send>(&step);
      if (sends == nullptr) continue;
      const auto [place, is_new] =
          publisher_of_.try_emplace({static_cast<int>(i), sends->topic}, publishers_.size());
      if (!is_new) continue;
      publishers_.push_back({.id = process.publishers++,
                             .process = callback.process,
                             .topic = sends->topic,
                             .gid = 0x1000 + publishers_.size(),
                             .published = 0,
                             .last_stamp = 0,
                             .last_arrival = {}});
    }
  }
}

void Application::launch() {
  for (int i = 0; i < system_.processes; ++i) {
    auto& process = processes_[static_cast<std::size_t>(i)];
    process.pid = next_tid_++;
    truth_.pids.push_back(process.pid);
    process.main = machine_.create(process.pid, "app" + std::to_string(i),
                                   [this, i](ThreadNumber) { run_main(i); });
  }
  for (std::size_t i = 0; i < system_.loads.size(); ++i) {
    const auto number = machine_.create(next_tid_++, "load" + std::to_string(i),
                                        [this, i](ThreadNumber load) { run_load(i, load); });
    machine_.act(number, [this, i, number] {
      machine_.set_parameters(number, system_.loads[i].parameters);
    });
  }
  machine_.at(kBeginning + system_.duration, [this] { stop(); });
}

void Application::run_load(std::size_t load, ThreadNumber number) {
  if (is_stopping_) return;
  for (const auto& step : system_.loads[load].steps)
    execute(number, step);
  machine_.sleep(number, system_.loads[load].period);
}

void Application::stop() {
  is_stopping_ = true;
  for (const auto& thread : threads_)
    machine_.signal(thread.number);
  for (const auto& process : processes_) {
    machine_.signal(process.main);
    if (system_.attach) machine_.signal(process.announcer);
  }
}

void Application::run_main(int index) {
  auto& process = processes_[static_cast<std::size_t>(index)];
  if (!std::exchange(process.has_begun, true)) {
    register_everything(index);
    start_threads(index);
  } else if (!is_stopping_ || process.alive > 0) {
    machine_.wait(process.main);
  } else if (!std::exchange(process.has_ended, true)) {
    finish(index);
  }
}

void Application::register_everything(int index) {
  const auto main = processes_[static_cast<std::size_t>(index)].main;
  machine_.act(main, [this, index, main] { tell_run_begin(index, main, RunMoment::start); });
  machine_.act(main, [this, index, main] {
    emit(index, main,
         analysis::ClockSync{.monotonic_ns = machine_.now(),
                             .realtime_ns = machine_.now() + kRealtimeOffset});
  });
  machine_.act(main, [this, index, main] {
    emit(index, main,
         analysis::NodeInit{.node = NodeId{0}, .name = tape_.keep("/n" + std::to_string(index))});
  });
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    if (groups_[i].process == index) machine_.act(main, [this, i, main] { tell_group(i, main); });
  }
  for (int i = 0; i < static_cast<int>(callbacks_.size()); ++i) {
    if (system_.callbacks[static_cast<std::size_t>(i)].process == index) {
      machine_.act(main, [this, i, main] { tell_callback(i, main); });
    }
  }
  for (std::size_t i = 0; i < publishers_.size(); ++i) {
    if (publishers_[i].process == index) {
      machine_.act(main, [this, i, main] { tell_publisher(i, main); });
    }
  }
}

void Application::start_threads(int index) {
  auto& process = processes_[static_cast<std::size_t>(index)];
  const auto main = process.main;
  process.alive = 1;  // until all are created
  machine_.act(main, [this, index] {
    start_thread(index,
                 Thread{.role = ThreadRole::worker, .server = -1, .parameters = system_.receiver},
                 "recv");
  });
  for (std::size_t i = 0; i < system_.servers.size(); ++i) {
    const auto& server = system_.servers[i];
    if (server.process != index) continue;
    machine_.act(main, [this, index, i] {
      const auto& wanted = system_.servers[i];
      start_thread(index,
                   Thread{.role = wanted.is_isolated ? ThreadRole::callback : ThreadRole::pool,
                          .server = static_cast<int>(i),
                          .parameters = wanted.parameters},
                   wanted.name);
    });
  }
  machine_.act(main, [this, index] {
    auto& created = processes_[static_cast<std::size_t>(index)];
    --created.alive;
    if (!system_.attach) return;
    created.announcer = machine_.create(
        next_tid_++, "cie-announce", [this, index](ThreadNumber) { run_announcer(index); },
        created.main);
    machine_.at(kBeginning + *system_.attach, [this, index] {
      processes_[static_cast<std::size_t>(index)].is_announcing = true;
      machine_.signal(processes_[static_cast<std::size_t>(index)].announcer);
    });
  });
}

void Application::finish(int index) {
  const auto& process = processes_[static_cast<std::size_t>(index)];
  const auto main = process.main;
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    if (system_.callbacks[i].process != index) continue;
    machine_.act(main, [this, i, index, main] {
      const auto& state = callbacks_[i];
      emit(index, main,
           analysis::CallbackFini{.callback = CallbackId{state.id},
                                  .started = state.started,
                                  .ended = state.ended,
                                  .released = state.released,
                                  .overwritten = state.overwritten,
                                  .lost = 0});
    });
  }
  for (const auto& publisher : publishers_) {
    if (publisher.process != index) continue;
    machine_.act(main, [this, &publisher, index, main] {
      emit(index, main,
           analysis::PublisherFini{.publisher = PublisherId{publisher.id},
                                   .published = publisher.published});
    });
  }
  machine_.act(main, [this, index, main] {
    const auto& ended = processes_[static_cast<std::size_t>(index)];
    emit(index, main,
         analysis::RunEnd{.callbacks = ended.callbacks,
                          .threads = static_cast<std::uint32_t>(ended.threads.size()),
                          .groups = ended.groups,
                          .publishers = ended.publishers,
                          .status = 0});
  });
}

Truth Application::truth() && {
  for (std::size_t i = 0; i < threads_.size(); ++i) {
    truth_.threads[i].busy = machine_.account(threads_[i].number).execution;
  }
  for (const auto& callback : callbacks_)
    truth_.overwritten.push_back(callback.overwritten);
  truth_.inherited = machine_.inherited();
  return std::move(truth_);
}

Simulation simulate(const System& system) {
  Simulation simulation{.tape = Tape(system.cpus), .truth = {}};
  Machine machine(system.cpus, system.mutexes, system.seed, simulation.tape);
  Application application(system, machine, simulation.tape);
  application.launch();
  machine.run();
  simulation.truth = std::move(application).truth();
  return simulation;
}

}  // namespace cie::sim
