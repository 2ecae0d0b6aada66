#include "target/target.hpp"

#include <cie/tracepoints/ros2_profile.hpp>

#include <algorithm>
#include <csignal>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::record {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kTick{100};

milliseconds tick_of(const Options& options) {
  return options.snapshot ? std::min(kTick, pace_of(options.snapshot->length).look) : kTick;
}

}  // namespace

Target::Target(const Options& options) : options_(options), tick_(tick_of(options)) {
  if (is_command()) witness_.emplace();
}

void Target::start() {
  began_ = std::chrono::steady_clock::now();
  if (!is_command()) {
    return;
  }
  ChildOptions child;
  // LTTng's default gives up after 3 s and lets the application run untraced.
  child.environment.emplace_back("LTTNG_UST_REGISTER_TIMEOUT", "-1");
  if (options_.ros2 == Ros2Events::profile && !is_watched_live()) {
    child.environment.emplace_back(kProfileVariable, kRos2Profile);
  }
  child.dies_with_parent = is_watched_live();
  command_.emplace(options_.command, child);
}

std::optional<Target::Event> Target::next() {
  milliseconds patience = tick_;
  if (is_command()) {
    if (exit()) return std::nullopt;
  } else {
    if (is_interrupted_) return std::nullopt;
    if (options_.duration) {
      if (left() <= left().zero()) return std::nullopt;
      patience = std::min(tick_, std::chrono::ceil<milliseconds>(left()));
    }
  }
  const auto signal = signals_.wait(patience);
  if (is_command()) escalate(escalation_.pass(Escalation::Clock::now()));
  if (!signal || signal->number == SIGCHLD) {
    return Event::tick;
  }
  if (signal->number == SIGUSR1) {
    return Event::request;
  }
  pass_on(*signal);
  return is_interrupted_ ? std::nullopt : std::optional(Event::tick);
}

void Target::pass_on(const ReceivedSignal& signal) {
  if (!has_command_got(signal)) interrupt(signal.number);
  // Programs may read a configuration anew on SIGHUP.
  if (is_command() && signal.number != SIGHUP) {
    escalate(escalation_.ask(Escalation::Clock::now()));
  }
}

// The terminal and killpg() signal the command, too. Who does it to this process, and then to its whole
// group (timeout(1)), means one signal.
bool Target::has_command_got(const ReceivedSignal& signal) {
  if (!command_ || getpgid(command_->pid()) != getpgrp()) return false;
  const auto now = Escalation::Clock::now();
  if (witness_->has_seen(signal.number).value_or(signal.is_from_terminal)) {
    group_signalled_[signal.number] = now;
    return true;
  }
  const auto before = group_signalled_.find(signal.number);
  return before != group_signalled_.end() && now - before->second < Escalation::kSame;
}

void Target::escalate(Escalation::Step step) {
  switch (step) {
    case Escalation::Step::none:
      return;
    case Escalation::Step::say_so:
      news_ = fmt::format(
          "\"{}\" (pid {}) was asked to end and goes on: the recording ends with it. Ctrl-C again "
          "ends it (SIGTERM, {} s later SIGKILL)",
          options_.command.front(), pid(), Escalation::kUntilKilled.count());
      return;
    case Escalation::Step::terminate:
      news_ = fmt::format(
          "sent SIGTERM to \"{}\" (pid {}); SIGKILL follows in {} s, or with one more Ctrl-C",
          options_.command.front(), pid(), Escalation::kUntilKilled.count());
      interrupt(SIGTERM);
      return;
    case Escalation::Step::kill:
      news_ = fmt::format("killed \"{}\" (pid {}), which did not end{}", options_.command.front(),
                          pid(), is_watched_live() ? "" : "; what was recorded is kept");
      interrupt(SIGKILL);
      return;
  }
}

void Target::note_registered() noexcept {
  if (!counted_from_) counted_from_ = std::chrono::steady_clock::now();
}

std::chrono::steady_clock::duration Target::left() const noexcept {
  const auto from = counted_from_.value_or(began_ + options_.registration_timeout);
  return from + *options_.duration - std::chrono::steady_clock::now();
}

void Target::interrupt(int signal) noexcept {
  if (command_) {
    command_->kill(signal);
  } else {
    is_interrupted_ = true;
  }
}

void Target::end() noexcept {
  interrupt(SIGTERM);
  if (is_command()) escalation_.terminated(Escalation::Clock::now());
}

std::optional<ExitStatus> Target::exit() { return command_ ? command_->poll() : std::nullopt; }

}  // namespace cie::record
