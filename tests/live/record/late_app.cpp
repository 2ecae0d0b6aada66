// A timer of an executor that declares a deadline of 5 ms and needs 20 ms for its tenth instance,
// of 20.
#include <cie/executor/executor.hpp>

#include <chrono>
#include <thread>

int main() {
  using namespace std::chrono_literals;
  const cie::Context context;
  cie::Node node{context, "late", "/"};
  cie::CallbackIsolatedExecutor executor;
  int instances = 0;
  const auto timer = node.create_wall_timer(50ms,
                                            [&] {
                                              if (++instances == 10)
                                                std::this_thread::sleep_for(20ms);
                                              if (instances == 20) executor.cancel();
                                            },
                                            {.deadline = 5ms});
  executor.add_node(node);
  executor.spin();
}
