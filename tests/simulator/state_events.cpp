// State events: what the processes of a simulation tell of themselves.
#include "simulator/application.hpp"

#include <numeric>

namespace cie::sim {

using namespace analysis;

void Application::emit(int process, ThreadNumber number, const EventBody& body) {
  tape_.user(machine_.now(), machine_.cpu_of(number),
             processes_[static_cast<std::size_t>(process)].pid, machine_.tid_of(number), body);
}

void Application::tell_run_begin(int process, ThreadNumber teller, RunMoment moment) {
  const auto pid = processes_[static_cast<std::size_t>(process)].pid;
  emit(process, teller,
       RunBegin{.contract_version = kContractVersion,
                .tool_version = "simulator",
                .executor = "isolated",
                .boot_id = "boot",
                .host = "robot",
                .pid = static_cast<std::uint32_t>(pid),
                .pid_ns = 1,
                .process_start_ns = kBeginning - pid,
                .monotonic_ns = machine_.now(),
                .realtime_ns = machine_.now() + kRealtimeOffset,
                .online_cpus = static_cast<std::uint32_t>(system_.cpus),
                .spec_sha256 = {},
                .moment = moment});
}

void Application::tell_group(std::size_t index, ThreadNumber teller) {
  const auto& group = groups_[index];
  emit(
      group.process, teller,
      GroupInit{.group = GroupId{group.id},
                .node = NodeId{0},
                .type = group.is_reentrant ? GroupType::reentrant : GroupType::mutually_exclusive});
}

void Application::tell_callback(int index, ThreadNumber teller) {
  const auto& callback = system_.callbacks[static_cast<std::size_t>(index)];
  const auto& state = callbacks_[static_cast<std::size_t>(index)];
  emit(callback.process, teller,
       CallbackInit{.callback = CallbackId{state.id},
                    .group = GroupId{state.group},
                    .node = NodeId{0},
                    .kind = callback.kind,
                    .logical_id = state.logical_id,
                    .source = state.source,
                    .symbol = state.logical_id,
                    .period_ns = static_cast<std::uint64_t>(callback.period),
                    .queue_depth = static_cast<std::uint32_t>(callback.depth),
                    .deadline_ns = static_cast<std::uint64_t>(callback.deadline),
                    .next_seq = state.started});
}

void Application::tell_publisher(std::size_t index, ThreadNumber teller) {
  const auto& publisher = publishers_[index];
  emit(publisher.process, teller,
       PublisherInit{
           .publisher = PublisherId{publisher.id},
           .node = NodeId{0},
           .topic = tape_.keep(system_.topics[static_cast<std::size_t>(publisher.topic)].name),
           .writer_gid = publisher.gid,
           .next_seq = publisher.published});
}

void Application::tell_thread(std::size_t index, ThreadNumber teller) {
  auto& thread = threads_[index];
  if (thread.announced == 0) thread.announced = machine_.now();
  std::uint32_t callback = kNoId;
  std::uint32_t group = kNoId;
  if (thread.role == ThreadRole::callback) {
    const auto& server = system_.servers[static_cast<std::size_t>(thread.server)];
    const auto& state = callbacks_[static_cast<std::size_t>(server.callbacks.front())];
    if (server.callbacks.size() == 1) callback = state.id;  // else announced for its group
    group = state.group;
  }
  emit(thread.process, teller,
       ThreadInit{.tid = static_cast<std::uint32_t>(machine_.tid_of(thread.number)),
                  .role = thread.role,
                  .callback = CallbackId{callback},
                  .group = GroupId{group},
                  .name = tape_.keep(truth_.threads[index].name),
                  .start_ns = thread.announced});
}

void Application::tell_parameters(std::size_t index, ThreadNumber teller, SchedMoment moment) {
  auto& thread = threads_[index];
  const auto& runs_as = machine_.parameters(thread.number);
  std::vector<std::uint32_t> cpus(static_cast<std::size_t>(system_.cpus));
  std::iota(cpus.begin(), cpus.end(), 0);
  const bool is_deadline = runs_as.policy == Policy::deadline;
  emit(thread.process, teller,
       ThreadSched{.tid = static_cast<std::uint32_t>(machine_.tid_of(thread.number)),
                   .moment = moment,
                   .n = thread.read_backs++,
                   .policy = static_cast<std::int32_t>(*runs_as.policy),
                   .flags = 1,
                   .nice = runs_as.nice,
                   .priority = runs_as.priority,
                   .runtime_ns = is_deadline ? runs_as.runtime_ns : 0,
                   .deadline_ns = is_deadline ? runs_as.deadline_ns : 0,
                   .period_ns = is_deadline ? runs_as.period_ns : 0,
                   .cpus = tape_.keep(runs_as.cpus.value_or(cpus)),
                   .error = 0,
                   .slice_ns = 0,
                   .util_min = 0,
                   .util_max = 1024,
                   .change = 0});
}

void Application::announce(int index) {
  const auto teller = processes_[static_cast<std::size_t>(index)].announcer;
  const auto act = [this, teller](Machine::Action action) { machine_.act(teller, action); };
  act([this, index, teller] { tell_run_begin(index, teller, RunMoment::announce); });
  act([this, index, teller] {
    emit(
        index, teller,
        ClockSync{.monotonic_ns = machine_.now(), .realtime_ns = machine_.now() + kRealtimeOffset});
  });
  act([this, index, teller] {
    emit(index, teller,
         NodeInit{.node = NodeId{0}, .name = tape_.keep("/n" + std::to_string(index))});
  });
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    if (groups_[i].process == index) act([this, i, teller] { tell_group(i, teller); });
  }
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    if (system_.callbacks[i].process != index) continue;
    act([this, i, teller] { tell_callback(static_cast<int>(i), teller); });
  }
  for (std::size_t i = 0; i < publishers_.size(); ++i) {
    if (publishers_[i].process == index) act([this, i, teller] { tell_publisher(i, teller); });
  }
  for (const auto thread : processes_[static_cast<std::size_t>(index)].threads) {
    act([this, thread, teller] {
      if (!threads_[thread].has_left) tell_thread(thread, teller);
    });
    act([this, thread, teller] {
      if (!threads_[thread].has_left) tell_parameters(thread, teller, SchedMoment::audit);
    });
  }
  act([this] { truth_.announced.push_back(machine_.now()); });
}

void Application::run_announcer(int index) {
  auto& process = processes_[static_cast<std::size_t>(index)];
  if (process.is_announcing) {
    process.is_announcing = false;
    announce(index);
  } else if (!is_stopping_) {
    machine_.wait(process.announcer);
  }
}

}  // namespace cie::sim
