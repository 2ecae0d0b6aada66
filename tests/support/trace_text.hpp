// Traces written as text beside the answer that a test expects of them.
//
//   const auto trace = trace_of(R"(
//     callback fusion subscription topic=/points
//     10 release fusion
//     12 start fusion
//     20 end fusion)");
//   const auto result = analyze(trace);
//
// A line is a directive or `TIME VERB …` (nanoseconds, any order, `#` comments). Directives declare
// who exists; everything undeclared of a well-behaved run is added: run_begin, node, group and
// callback registration, one isolated thread per callback with an initial and an applied read-back
// (SCHED_OTHER, CPUs 0 and 1) before time 0, and all totals after the last line. Numbers (seq, n)
// are counted. What is then to be missing is erased from `events`.
//
// Directives (names are words; a callback's thread has the callback's name):
//   process NAME [pid=100] [executor=isolated] [spec=SHA256] [from=T] [until=T] [attached] [crash] [ahead=NS]
//       what is declared from here on belongs to it; one is there without being declared. ahead: it is in a
//       time namespace, of which its run_begin alone tells; its times are as written
//   callback NAME [timer|subscription|service|client|waitable] [id=LOGICAL] [period=10] [deadline=0]
//       [topic=/t] [group=NAME] [next=0] [cpu=0] [pooled]      pooled: no thread of its own
//   group NAME [reentrant]
//   thread NAME pool|worker|callback [of=CALLBACK] [cpu=0] [tid=N] [silent]   silent: not announced
//   publisher NAME [topic=/t] [next=0]
//   kernel                             a kernel channel even if no line needs it
// Verbs (C callback, T thread, P publisher; any user event takes cpu=N and `on=T`):
//   release C [overwritten=N] · wakeup C [spurious] · lost C count=N
//   unsent P [total=N] (of the message that it published last)
//   start C [release=T|none] [missed=N] [seq=N] [from=P:SEQ]     release: the last release or wakeup
//   end C [seq=N] [exception] · publish P on=T [seq=N]
//   initial|applied|audit T [policy=fifo|rr|other|batch|idle|deadline|ext] [priority= nice= runtime=
//       deadline= period= cpus=0,1 error= n= slice= util_min= util_max= change=]
//       [old]                          as recordings had it before slice and clamps
//   begin T [again] [for=C] · finish T thread_init, thread_fini, instead of those that are added;
//                                      again: another spin on the thread that T was, for C
//   repeat T on=MAIN                   thread_init, as another thread repeats it in an announcement
//   init C · fini C                    callback_init (again), callback_fini, likewise
//   reload [spec=SHA256]               run_begin again, for another spec
//   switch CPU PREV NEXT [state=N] [prio=N] [next_prio=N] · waking T · fork T T · exit T · exec T
//       `idle` is the idle thread; states are the kernel's (0 runnable, 1 blocked)
//   preempt T by=T · block T · resume T       switches on T's CPU
//   boost T prio=N [old=N]             sched_pi_setprio
//   discard user|kernel until=T [count=N] [packets] · damage user|kernel [until=T] · regress previous=T
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/event.hpp>

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cie::test {

struct TextTrace {
  std::vector<analysis::Event> events;  // in order of time, the structural ones included

  // What the events' views look at.
  std::shared_ptr<std::deque<std::string>> strings;
  std::shared_ptr<std::deque<std::vector<std::uint32_t>>> cpus;
  std::vector<std::shared_ptr<const void>> more{};  // of traces that became part of this one

  // Removes events of one kind for which the predicate holds; returns how many.
  template <typename Body, typename Predicate>
  std::size_t erase(Predicate predicate) {
    return std::erase_if(events, [&predicate](const analysis::Event& event) {
      const auto* body = std::get_if<Body>(&event.body);
      return body != nullptr && predicate(*body, event.head);
    });
  }
  template <typename Body>
  std::size_t erase() {
    return erase<Body>([](const Body&, const analysis::EventHead&) { return true; });
  }
};

// Throws std::invalid_argument with the line that it does not understand.
TextTrace trace_of(std::string_view text);

analysis::AnalysisResult analyze(const TextTrace& trace,
                                 const analysis::AnalysisOptions& options = {},
                                 analysis::Observer* observer = nullptr);

}  // namespace cie::test
