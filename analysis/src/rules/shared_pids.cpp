#include "shared_pids.hpp"

#include "judgement.hpp"

#include <string_view>

namespace cie::analysis {
namespace {

std::string_view code_of(PidSharing sharing) {
  switch (sharing) {
    case PidSharing::other_init:
      return "pid-shared-other-init";
    case PidSharing::perhaps:
      return "pid-perhaps-shared";
    case PidSharing::announced_late:
      return "pid-shared-announced-late";
    case PidSharing::told_again:
      return "pid-shared-told-again";
    case PidSharing::crossed:
      return "pid-shared-crossed";
    case PidSharing::beside_own:
      return "pid-shared-beside-own";
    case PidSharing::begun:
      break;
  }
  return "pid-shared";
}

}  // namespace

Evidence shared_pid(const ProcessFacts& process) {
  return without_event(*process.shares_pid_since, note(code_of(process.pid_sharing)));
}

}  // namespace cie::analysis
