// Messages between processes of one machine through the shared memory of iceoryx.
#include "dds/context_state.hpp"
#include "dds/writer.hpp"
#include "support.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <dds/ddsc/dds_loan_api.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <test_services.hpp>

namespace cie::test {
namespace {

using cie_msgs::Sample;
using Request = test_services::Add_Request;
using Response = test_services::Add_Response;

constexpr std::uint64_t kRounds = 50;
constexpr std::uint32_t kPayload = 1'000'000;

Context::Options shared_options() {
  auto options = private_options();
  options.shared_memory = true;
  return options;
}

// Whether RouDi takes requests.
bool is_there() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::ranges::copy(std::string_view{"/tmp/roudi"}, address.sun_path);
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool is_connected =
      connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  close(socket);
  return is_connected;
}

// RouDi for this test: one that runs already, or its own. Its end is the end of all processes that
// use it, so this process does not, and its children do the work.
class SharedMemory : public testing::Test {
 protected:
  void SetUp() override {
    if (is_there()) return;
    const char* const arguments[] = {"iox-roudi", "--log-level", "off", nullptr};
    if (posix_spawnp(&roudi_, arguments[0], nullptr, nullptr, const_cast<char* const*>(arguments),
                     environ) != 0) {
      roudi_ = 0;
      GTEST_SKIP() << "iox-roudi (Debian package iceoryx) is not installed";
    }
    bool is_gone = false;
    eventually([&] {
      is_gone = waitpid(roudi_, nullptr, WNOHANG) == roudi_;
      return is_gone || is_there();
    });
    if (is_gone) {
      roudi_ = 0;
      GTEST_SKIP() << "not possible here: iox-roudi does not get its memory";
    }
    ASSERT_TRUE(is_there());
  }
  void TearDown() override {
    if (roudi_ == 0) return;
    kill(roudi_, SIGTERM);
    waitpid(roudi_, nullptr, 0);
  }
  static bool ended_well(pid_t child) {
    int status = -1;
    return waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }

 private:
  pid_t roudi_ = 0;
};

// Not a test of its own: sends the next message when the last one was answered.
TEST(SharedMemoryAsker, DISABLED_Asks) {
  Context context;
  Node node{context, "asker"};
  const auto questions = node.create_publisher<Sample>("question", 10);
  constexpr std::uint64_t kNone = kRounds + 1;
  std::atomic<std::uint64_t> answered{kNone};
  const auto answers = node.create_subscription<Sample>(
      "answer", 10, [&](const Sample& answer) { answered = answer.seq; });
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};
  ASSERT_TRUE(eventually(
      [&] { return questions->subscription_count() == 1 && answers->publisher_count() == 1; }));
  // DDS matches both sides before the shared memory is connected: what is sent meanwhile is lost.
  ASSERT_TRUE(eventually([&] {
    questions->publish(make_message<Sample>());
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
    return answered != kNone;
  }));
  for (std::uint64_t round = 1; round <= kRounds; ++round) {
    auto message = make_message<Sample>();
    message->seq = round;
    resize(message->payload, kPayload);
    message->payload._buffer[kPayload - 1] = static_cast<std::uint8_t>(round);
    questions->publish(std::move(message));
    ASSERT_TRUE(eventually([&] { return answered == round; })) << round;
  }
}

// Not a test of its own.
TEST(SharedMemoryAnswerer, DISABLED_Answers) {
  Context context;
  {
    const executor::Writer writer{context.state(), NodeId{}, executor::message_topic("/probe"),
                                  QoS{10}, MessageTraits<Sample>::descriptor()};
    EXPECT_TRUE(dds_is_shared_memory_available(writer.entity()));
  }
  Node node{context, "answerer"};
  std::vector<std::uint64_t> seen;
  std::atomic<std::uint64_t> count{0};
  std::uint64_t wrong = 0;
  const auto answers = node.create_publisher<Sample>("answer", 10);
  const auto questions = node.create_subscription<Sample>(
      "question", 10, [&](const Sample& question, const MessageInfo& info) {
        if (question.seq == 0) {  // to see whether we are there
          answers->publish(make_message<Sample>());
          return;
        }
        seen.push_back(question.seq);
        if (question.payload._length != kPayload ||
            question.payload._buffer[kPayload - 1] != static_cast<std::uint8_t>(question.seq) ||
            info.arrival_ns <= 0 || info.writer_gid == 0) {
          ++wrong;
        }
        auto answer = make_message<Sample>();
        answer->seq = question.seq;
        answers->publish(std::move(answer));
        ++count;
      });
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  Spinning spinning{executor};
  EXPECT_TRUE(eventually([&] { return count == kRounds; }));
  // The asker goes when it has the last answer.
  EXPECT_TRUE(eventually([&] { return questions->publisher_count() == 0; }));
  spinning.cancel_and_wait();
  EXPECT_EQ(wrong, 0U);
  ASSERT_EQ(seen.size(), kRounds);
  for (std::uint64_t i = 0; i < kRounds; ++i)
    EXPECT_EQ(seen[i], i + 1);
}

// Not a test of its own.
TEST(SharedMemoryServices, DISABLED_Call) {
  Context context;
  Node node{context, "node"};
  const auto service =
      node.create_service<Request, Response>("add", [](const Request& request, Response& response) {
        response.sum = request.a + request.b;
        set_text(response.remark, "added");
      });
  const auto first = node.create_client<Request, Response>("add");
  const auto second = node.create_client<Request, Response>("add");
  CallbackIsolatedExecutor executor;
  executor.add_node(node);
  const Spinning spinning{executor};
  ASSERT_TRUE(first->wait_for_service(20s) && second->wait_for_service(20s));
  for (std::int64_t i = 0; i < 20; ++i) {
    Request request{};
    request.a = i;
    auto of_first = first->async_send_request(request);
    request.a = -i;
    auto of_second = second->async_send_request(request);
    ASSERT_EQ(of_first.wait_for(20s), std::future_status::ready);
    ASSERT_EQ(of_second.wait_for(20s), std::future_status::ready);
    const auto response = of_first.get();
    EXPECT_EQ(response->sum, i);
    EXPECT_STREQ(response->remark, "added");
    EXPECT_EQ(of_second.get()->sum, -i);
  }
}

TEST_F(SharedMemory, CarriesMessagesBetweenProcesses) {
  const pid_t asker = start_child(shared_options(), "SharedMemoryAsker.*");
  const pid_t answerer = start_child(shared_options(), "SharedMemoryAnswerer.*");
  EXPECT_TRUE(ended_well(asker));
  EXPECT_TRUE(ended_well(answerer));
}

TEST_F(SharedMemory, CarriesEachResponseToWhoAsked) {
  EXPECT_TRUE(ended_well(start_child(shared_options(), "SharedMemoryServices.*")));
}

TEST(NoSharedMemory, IsSaidInWords) {
  if (is_there()) GTEST_SKIP() << "not possible here: somebody else's RouDi is running";
  try {
    const Context context{shared_options()};
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string{error.what()}.find("start iox-roudi"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace cie::test
