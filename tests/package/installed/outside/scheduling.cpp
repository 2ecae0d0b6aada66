// A thread of somebody else's executor, configured and traced, without DDS.
#include <cie/scheduling/team.hpp>

#include <atomic>

int main() {
  cie::ExecutorOptions options;
  cie::scheduling::ThreadConfigurator configurator{options};
  std::atomic<bool> has_run{false};
  cie::scheduling::Team team{{.run = [&has_run] { has_run = true; }, .stop = [] {}},
                             {{.role = cie::ThreadRole::worker, .name = "mine"}},
                             configurator};
  if (!team.wait_configured().empty()) return 1;
  team.open_gate();
  team.join();
  return has_run ? 0 : 1;
}
