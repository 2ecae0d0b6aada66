// Executors of a simulation: threads that wait for callbacks and run them, queues and messages.
#include "simulator/application.hpp"

#include <algorithm>
#include <memory>
#include <utility>

namespace cie::sim {

using namespace analysis;

namespace {

constexpr Range kTimerDelay{1, 4'000};  // from an expiry until the kernel notices

Account difference(const Account& later, const Account& earlier) {
  Account parts{.execution = later.execution - earlier.execution,
                .preempted = later.preempted - earlier.preempted,
                .blocked = later.blocked - earlier.blocked,
                .wake_delay = later.wake_delay - earlier.wake_delay,
                .waking = later.waking - earlier.waking,
                .instead = later.instead};
  for (const auto& [tid, time] : earlier.instead)
    parts.instead[tid] -= time;
  std::erase_if(parts.instead, [](const auto& entry) { return entry.second == 0; });
  return parts;
}

}  // namespace

void Application::start_thread(int index, Thread thread, const std::string& name) {
  auto& process = processes_[static_cast<std::size_t>(index)];
  const auto place = threads_.size();
  const auto tid = next_tid_++;
  thread.process = index;
  thread.number = machine_.create(
      tid, name, [this, place](ThreadNumber) { serve(place); }, process.main);
  if (thread.server < 0) process.receiver = place;
  process.threads.push_back(place);
  ++process.alive;
  threads_.push_back(std::move(thread));
  truth_.threads.push_back({.pid = process.pid, .tid = tid, .name = name});
}

void Application::configure(std::size_t place) {
  const auto number = threads_[place].number;
  threads_[place].is_configured = true;
  machine_.act(number, [this, place, number] {
    tell_thread(place, number);
    machine_.forget_wake_up(number);
  });
  machine_.act(number,
               [this, place, number] { tell_parameters(place, number, SchedMoment::initial); });
  machine_.act(number, [this, place, number] {
    machine_.set_parameters(number, threads_[place].parameters);
  });
  machine_.act(number,
               [this, place, number] { tell_parameters(place, number, SchedMoment::applied); });
  if (threads_[place].server < 0) return;
  machine_.act(number, [this, place] {
    const auto& server = system_.servers[static_cast<std::size_t>(threads_[place].server)];
    for (const auto callback : server.callbacks)
      arm(callback);
  });
}

void Application::leave(std::size_t place) {
  auto& thread = threads_[place];
  const auto number = thread.number;
  if (std::exchange(thread.has_left, true)) return;
  machine_.act(number,
               [this, place, number] { tell_parameters(place, number, SchedMoment::audit); });
  machine_.act(number, [this, place, number] {
    const auto& left = threads_[place];
    emit(left.process, number,
         ThreadFini{.tid = static_cast<std::uint32_t>(machine_.tid_of(number)),
                    .read_backs = left.read_backs});
    auto& told = truth_.threads[place];
    const auto first_wait =
        machine_.first_wait(number).value_or(std::pair{machine_.now(), told.busy});
    told.first_wait = first_wait.first;
    told.execution_before = first_wait.second;
    told.end = machine_.now();
    told.execution = machine_.account(number).execution;
    auto& process = processes_[static_cast<std::size_t>(left.process)];
    --process.alive;
    machine_.signal(process.main);
  });
}

void Application::serve(std::size_t place) {
  auto& thread = threads_[place];
  if (!thread.is_configured) return configure(place);
  if (is_stopping_) return leave(place);
  if (thread.server < 0) return receive(place);
  const auto& callbacks = system_.servers[static_cast<std::size_t>(thread.server)].callbacks;
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    const auto which = (thread.next_callback + i) % callbacks.size();
    if (!is_ready(callbacks[which])) continue;
    thread.next_callback = which + 1;
    return run_instance(place, callbacks[which]);
  }
  wait(place);
}

void Application::wait(std::size_t place) {
  auto& thread = threads_[place];
  thread.is_idle = true;
  machine_.wait(thread.number);
  machine_.act(thread.number, [this, place] {
    auto& woken = threads_[place];
    woken.is_idle = false;
    if (woken.server < 0 || !machine_.has_waited(woken.number)) return;
    const auto& server = system_.servers[static_cast<std::size_t>(woken.server)];
    const auto first = static_cast<std::size_t>(server.callbacks.front());
    const bool is_timer = system_.callbacks[first].kind == CallbackKind::timer;
    woken.wakeup = machine_.now();
    woken.cpu_wakeup = machine_.cpu_of(woken.number);
    emit(woken.process, woken.number,
         ThreadWakeup{.callback = CallbackId{server.is_isolated ? callbacks_[first].id : kNoId},
                      .reason = is_timer ? WakeupReason::timer : WakeupReason::data});
  });
}

void Application::receive(std::size_t place) {
  auto& process = processes_[static_cast<std::size_t>(threads_[place].process)];
  if (process.inbox.empty()) return wait(place);
  const auto delivery = process.inbox.front();
  process.inbox.pop_front();
  const auto number = threads_[place].number;
  machine_.act(number, [this, number, delivery] { deliver(number, delivery); });
  machine_.act(number, [this, delivery] { notify(delivery.callback); });
}

void Application::arm(int index) {
  const auto& callback = system_.callbacks[static_cast<std::size_t>(index)];
  auto& state = callbacks_[static_cast<std::size_t>(index)];
  if (callback.kind != CallbackKind::timer || state.due) return;
  state.due = machine_.now() + callback.phase;
  tick(index, *state.due);
}

void Application::tick(int index, Ns due) {
  machine_.at(due + machine_.random().in(kTimerDelay), [this, index, due] {
    if (is_stopping_) return;
    notify(index);
    tick(index, due + system_.callbacks[static_cast<std::size_t>(index)].period);
  });
}

// Wakes one thread that may run the callback and has nothing to do, any of those.
void Application::notify(int callback) {
  std::vector<Thread*> idle;
  for (auto& thread : threads_) {
    if (thread.server < 0 || !thread.is_idle) continue;
    const auto& served = system_.servers[static_cast<std::size_t>(thread.server)].callbacks;
    if (std::ranges::find(served, callback) != served.end()) idle.push_back(&thread);
  }
  if (idle.empty()) return;
  const auto last = static_cast<Ns>(idle.size()) - 1;
  auto& chosen = *idle[static_cast<std::size_t>(machine_.random().between(0, last))];
  chosen.is_idle = false;
  machine_.signal(chosen.number);
}

bool Application::is_ready(int index) {
  const auto& group = groups_[static_cast<std::size_t>(group_of_[static_cast<std::size_t>(index)])];
  if (group.is_busy && !group.is_reentrant) return false;
  const auto& state = callbacks_[static_cast<std::size_t>(index)];
  if (system_.callbacks[static_cast<std::size_t>(index)].kind != CallbackKind::timer) {
    return !state.queue.empty();
  }
  return state.due && *state.due <= machine_.now();
}

Application::Taken Application::take(int index) {
  auto& state = callbacks_[static_cast<std::size_t>(index)];
  const auto& callback = system_.callbacks[static_cast<std::size_t>(index)];
  if (callback.kind != CallbackKind::timer) {
    const auto arrival = state.queue.front();
    state.queue.pop_front();
    ++state.taken;
    return {.release = arrival.time, .missed = 0, .message = arrival.message};
  }
  const auto skipped = (machine_.now() - *state.due) / callback.period;
  const auto release = *state.due + skipped * callback.period;
  state.due = release + callback.period;
  return {
      .release = release, .missed = static_cast<std::uint32_t>(skipped), .message = std::nullopt};
}

void Application::run_instance(std::size_t place, int index) {
  const auto number = threads_[place].number;
  groups_[static_cast<std::size_t>(group_of_[static_cast<std::size_t>(index)])].is_busy = true;
  const auto taken = take(index);
  machine_.act(number, [this, place, index, taken] { begin_instance(place, index, taken); });
  for (const auto& step : system_.callbacks[static_cast<std::size_t>(index)].steps)
    do_step(place, index, step);
  machine_.act(number, [this, place, index] { end_instance(place, index); });
}

void Application::do_step(std::size_t place, int index, const Step& step) {
  if (const auto* sent = std::get_if<Send>(&step)) {
    send(place, index, sent->topic);
  } else {
    execute(threads_[place].number, step);
  }
}

void Application::execute(ThreadNumber number, const Step& step) {
  if (const auto* compute = std::get_if<Compute>(&step)) {
    machine_.compute(number, machine_.random().in(compute->time));
  } else if (const auto* sleep = std::get_if<Sleep>(&step)) {
    machine_.sleep(number, machine_.random().in(sleep->time));
  } else if (const auto* lock = std::get_if<Lock>(&step)) {
    machine_.lock(number, lock->mutex);
  } else if (const auto* unlock = std::get_if<Unlock>(&step)) {
    machine_.unlock(number, unlock->mutex);
  }
}

void Application::begin_instance(std::size_t place, int index, const Taken& taken) {
  auto& thread = threads_[place];
  const auto& callback = system_.callbacks[static_cast<std::size_t>(index)];
  auto& state = callbacks_[static_cast<std::size_t>(index)];
  const bool is_timer = callback.kind == CallbackKind::timer;
  const bool tells_source = taken.message && callback.tells_source;
  const auto* message = tells_source ? &truth_.messages[*taken.message] : nullptr;
  emit(thread.process, thread.number,
       CallbackStart{.callback = CallbackId{state.id},
                     .seq = state.started,
                     .release_kind = !callback.tells_release ? ReleaseKind::none
                                     : is_timer              ? ReleaseKind::timer
                                                             : ReleaseKind::data,
                     .release_ns = callback.tells_release ? taken.release : -1,
                     .missed = taken.missed,
                     .source_timestamp_realtime_ns = message != nullptr ? message->stamp : 0,
                     .writer_gid = message != nullptr ? message->writer : 0});
  const auto cpu = machine_.cpu_of(thread.number);
  thread.running = truth_.instances.size();
  thread.at_start = machine_.account(thread.number);
  truth_.instances.push_back({.callback = index,
                              .thread = place,
                              .seq = state.started++,
                              .release = taken.release,
                              .missed = taken.missed,
                              .start = machine_.now(),
                              .end = std::nullopt,
                              .cpu_start = cpu,
                              .cpu_end = cpu,
                              .wakeup = thread.wakeup,
                              .cpu_wakeup = thread.cpu_wakeup,
                              .kernel_wakeup = machine_.last_wake_up(thread.number),
                              .execution_before = thread.at_start.execution,
                              .parts = {},
                              .message = taken.message,
                              .previous = thread.last_instance});
  thread.last_instance = thread.running;
}

void Application::end_instance(std::size_t place, int index) {
  auto& thread = threads_[place];
  auto& state = callbacks_[static_cast<std::size_t>(index)];
  auto& instance = truth_.instances[thread.running];
  emit(thread.process, thread.number,
       CallbackEnd{
           .callback = CallbackId{state.id}, .seq = instance.seq, .status = CallbackStatus::ok});
  instance.end = machine_.now();
  instance.cpu_end = machine_.cpu_of(thread.number);
  instance.parts = difference(machine_.account(thread.number), thread.at_start);
  ++state.ended;
  thread.wakeup.reset();
  machine_.forget_wake_up(thread.number);
  groups_[static_cast<std::size_t>(group_of_[static_cast<std::size_t>(index)])].is_busy = false;
}

void Application::send(std::size_t place, int index, int topic) {
  const auto number = threads_[place].number;
  // The index of a message is known when it is written.
  const auto message = std::make_shared<std::size_t>(0);
  machine_.act(number, [this, place, index, topic, message, number] {
    auto& publisher = publishers_[publisher_of_.at({index, topic})];
    const auto process = threads_[place].process;
    const auto stamp = std::max(publisher.last_stamp + 1, machine_.now() + kRealtimeOffset);
    publisher.last_stamp = stamp;
    emit(process, number,
         Publish{.publisher = PublisherId{publisher.id},
                 .seq = publisher.published++,
                 .source_timestamp_realtime_ns = stamp});
    *message = truth_.messages.size();
    truth_.messages.push_back({.topic = topic,
                               .writer = publisher.gid,
                               .published = machine_.now(),
                               .stamp = stamp,
                               .instance = threads_[place].running});
  });
  const auto& settings = system_.topics[static_cast<std::size_t>(topic)];
  for (int i = 0; i < static_cast<int>(callbacks_.size()); ++i) {
    const auto& taker = system_.callbacks[static_cast<std::size_t>(i)];
    if (taker.topic != topic) continue;
    if (settings.is_local && taker.process == threads_[place].process) {
      machine_.act(number, [this, number, i, message] {
        deliver(number, {.callback = i, .message = *message});
      });
      machine_.act(number, [this, i] { notify(i); });
      continue;
    }
    machine_.act(number, [this, i, index, topic, message] {
      const auto to = system_.callbacks[static_cast<std::size_t>(i)].process;
      auto& last = publishers_[publisher_of_.at({index, topic})].last_arrival[to];
      const auto transport =
          machine_.random().in(system_.topics[static_cast<std::size_t>(topic)].transport);
      last = std::max(last + 1, machine_.now() + transport);  // of one writer none overtakes
      machine_.at(last, [this, i, to, message] {
        auto& process = processes_[static_cast<std::size_t>(to)];
        if (!process.receiver || threads_[*process.receiver].has_left) return;
        process.inbox.push_back({.callback = i, .message = *message});
        machine_.signal(threads_[*process.receiver].number);
      });
    });
  }
}

void Application::deliver(ThreadNumber by, const Delivery& delivery) {
  const auto index = static_cast<std::size_t>(delivery.callback);
  auto& state = callbacks_[index];
  state.queue.push_back({.message = delivery.message, .time = machine_.now()});
  ++state.released;
  if (state.queue.size() > system_.callbacks[index].depth) {
    state.queue.pop_front();
    ++state.overwritten;
  }
  truth_.arrivals[index].push_back(
      {.time = machine_.now(), .waiting = state.queue.size() + (state.taken - state.started)});
  emit(system_.callbacks[index].process, by,
       CallbackRelease{.callback = CallbackId{state.id},
                       .release_seq = state.released - 1,
                       .overwritten = state.overwritten});
}

}  // namespace cie::sim
