#include "dds/warnings.hpp"

#include <chrono>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie::executor {
namespace {

TEST(Warnings, AreGivenOnce) {
  std::vector<std::string> given;
  Warnings warnings{[&](const std::string& text) { given.push_back(text); }};
  warnings.tell("a");
  warnings.tell("b");
  warnings.tell("a");
  EXPECT_EQ(given, (std::vector<std::string>{"a", "b"}));
}

// One that DDS's receive thread gives reaches the handler while it is still busy with another's.
TEST(Warnings, WaitForNoHandlerOfAnotherThread) {
  std::promise<void> second;
  bool has_come = false;
  Warnings warnings{[&](const std::string& text) {
    if (text == "second") {
      second.set_value();
    } else {
      has_come =
          second.get_future().wait_for(std::chrono::seconds{20}) == std::future_status::ready;
    }
  }};
  std::jthread busy{[&] { warnings.tell("first"); }};
  std::jthread receiver{[&] { warnings.tell("second"); }};
  busy.join();
  receiver.join();
  EXPECT_TRUE(has_come);
}

}  // namespace
}  // namespace cie::executor
