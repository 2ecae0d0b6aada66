// A process that tells again, after its run_end or a loss that may have taken that, that it begins.
#pragma once

#include <cie/analysis/event.hpp>

#include "model/facts.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <string>

namespace cie::analysis {

// Its pid and start are as before: it is another run of the process, or exec() made it another program.
// Which of them shows when ids are told. What is needed to tell the two programs apart then.
struct BegunAgain {
  EventHead head{};  // of its run_begin
  RunBegin event{};
  ProcessFacts before{};  // what was known of it until then
  // How many there were of all processes.
  std::size_t nodes = 0;
  std::size_t groups = 0;
  std::size_t callbacks = 0;
  std::size_t publishers = 0;
  // Its main thread, if it was seen: exec() leaves that alone.
  std::optional<ThreadIndex> main{};
  std::optional<EventRef> main_last_seen{};
  std::optional<EventRef> main_switched_in{};

  // The event's texts outlive its batch. The struct stays where it is from here on.
  void keep_texts() {
    std::size_t i = 0;
    for (auto* text :
         {&event.tool_version, &event.executor, &event.boot_id, &event.host, &event.spec_sha256}) {
      texts[i] = *text;
      *text = texts[i++];
    }
  }
  std::array<std::string, 5> texts{};
};

}  // namespace cie::analysis
