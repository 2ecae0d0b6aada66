// The traced processes of a simulation: executors with their threads, queues and publishers, which
// tell of themselves as tracepoints/README.md has it.
#pragma once

#include "machine.hpp"
#include "tape.hpp"
#include "truth.hpp"

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace cie::sim {

class Application {
 public:
  // Borrows all three.
  Application(const System& system, Machine& machine, Tape& tape);

  // Starts processes and loads; machine.run() then runs them to their end.
  void launch();
  // After the machine has run.
  Truth truth() &&;

 private:
  using ThreadNumber = Machine::ThreadNumber;
  struct Thread {
    ThreadNumber number = 0;  // in the machine
    int process = 0;
    ThreadRole role = ThreadRole::callback;
    int server = -1;  // -1: a receive thread
    ThreadParameters parameters{};
    Ns announced = 0;
    std::uint32_t read_backs = 0;
    bool is_configured = false;
    bool is_idle = false;  // waits, or is about to
    bool has_left = false;
    std::optional<Ns> wakeup{};
    std::int32_t cpu_wakeup = 0;
    std::optional<std::size_t> last_instance{};
    Account at_start{};  // of the instance it runs
    std::size_t running = 0;
    std::size_t next_callback = 0;  // that is asked first, of a server with several
  };
  struct Arrival {
    std::size_t message = 0;
    Ns time = 0;
  };
  struct CallbackState {
    std::uint32_t id = 0;
    std::uint32_t group = 0;
    std::deque<Arrival> queue{};
    std::optional<Ns> due{};  // timers, once armed
    std::uint64_t taken = 0;  // samples
    std::uint64_t started = 0;
    std::uint64_t ended = 0;
    std::uint64_t released = 0;
    std::uint64_t overwritten = 0;
    std::string_view logical_id{};
    std::string_view source{};
  };
  struct GroupState {
    std::uint32_t id = 0;
    int process = 0;
    bool is_reentrant = false;
    bool is_busy = false;
  };
  struct Publisher {
    std::uint32_t id = 0;
    int process = 0;
    int topic = 0;
    std::uint64_t gid = 0;
    std::uint64_t published = 0;
    Ns last_stamp = 0;
    std::map<int, Ns> last_arrival{};  // by process
  };
  struct Delivery {
    int callback = 0;
    std::size_t message = 0;
  };
  struct Process {
    std::int64_t pid = 0;
    ThreadNumber main = 0;
    ThreadNumber announcer = 0;
    bool has_begun = false;
    bool has_ended = false;
    bool is_announcing = false;
    std::size_t alive = 0;  // threads that serve or receive
    std::optional<std::size_t> receiver{};
    std::deque<Delivery> inbox{};
    std::vector<std::size_t> threads{};
    std::uint32_t callbacks = 0;
    std::uint32_t groups = 0;
    std::uint32_t publishers = 0;
  };
  struct Taken {
    Ns release = 0;
    std::uint32_t missed = 0;
    std::optional<std::size_t> message{};
  };

  // application.cpp: who there is, and processes from beginning to end.
  void number_entities();
  void run_main(int process);
  void register_everything(int process);
  void start_threads(int process);
  void finish(int process);
  void stop();
  void run_load(std::size_t load, ThreadNumber number);

  // state_events.cpp
  void emit(int process, ThreadNumber number, const analysis::EventBody& body);
  void tell_run_begin(int process, ThreadNumber teller, RunMoment moment);
  void tell_group(std::size_t group, ThreadNumber teller);
  void tell_callback(int callback, ThreadNumber teller);
  void tell_publisher(std::size_t publisher, ThreadNumber teller);
  void tell_thread(std::size_t thread, ThreadNumber teller);
  void tell_parameters(std::size_t thread, ThreadNumber teller, SchedMoment moment);
  void announce(int process);
  void run_announcer(int process);

  // executor.cpp
  void start_thread(int process, Thread thread, const std::string& name);
  void configure(std::size_t thread);
  void leave(std::size_t thread);
  void serve(std::size_t thread);
  void receive(std::size_t thread);
  void wait(std::size_t thread);
  void arm(int callback);
  void tick(int callback, Ns due);
  void notify(int callback);
  bool is_ready(int callback);
  Taken take(int callback);
  void run_instance(std::size_t thread, int callback);
  void do_step(std::size_t thread, int callback, const Step& step);
  void execute(ThreadNumber number, const Step& step);  // but for a Send
  void begin_instance(std::size_t thread, int callback, const Taken& taken);
  void end_instance(std::size_t thread, int callback);
  void send(std::size_t thread, int callback, int topic);
  void deliver(ThreadNumber by, const Delivery& delivery);

  const System& system_;
  Machine& machine_;
  Tape& tape_;
  Truth truth_;
  std::vector<Process> processes_;
  std::vector<CallbackState> callbacks_;
  std::vector<GroupState> groups_;
  std::vector<int> group_of_;  // by callback
  std::vector<Publisher> publishers_;
  std::map<std::pair<int, int>, std::size_t> publisher_of_;  // (callback, topic)
  std::deque<Thread> threads_;
  std::int64_t next_tid_ = 1000;
  bool is_stopping_ = false;
};

// A simulation from beginning to end.
struct Simulation {
  Tape tape;
  Truth truth{};
};
Simulation simulate(const System& system);

}  // namespace cie::sim
