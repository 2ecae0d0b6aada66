// The socket by which a running container takes orders, with clients that behave badly.
#include "control.hpp"

#include "support/temporary_directory.hpp"

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace cie::container {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

// Below the five seconds that a client may take, and above what a busy machine needs for nothing.
constexpr auto kAtOnce = 3s;

// A connection to the container of this process, by hand.
class RawClient {
 public:
  explicit RawClient(const std::filesystem::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.c_str(), path.string().size() + 1);
    const auto* const generic = reinterpret_cast<const sockaddr*>(&address);
    if (connect(socket_, generic, sizeof address) != 0) std::abort();
  }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  ~RawClient() { close(socket_); }

  void send(std::string_view text) const {
    (void)::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
  }
  // Whether the container has closed the connection.
  bool is_closed() const {
    pollfd wanted{.fd = socket_, .events = POLLIN, .revents = 0};
    char byte = 0;
    return poll(&wanted, 1, 0) > 0 && recv(socket_, &byte, 1, 0) <= 0;
  }
  int get() const { return socket_; }

 private:
  int socket_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

class Control : public testing::Test {
 protected:
  void SetUp() override { setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1); }
  void TearDown() override { unsetenv("XDG_RUNTIME_DIR"); }

  std::filesystem::path path() const {
    return folder_.path() / "cie-run" / (std::to_string(getpid()) + ".sock");
  }
  static ControlServer::Handler echo() {
    return [](const std::vector<std::string>& words) {
      return Answer{.exit_code = 0, .text = words.empty() ? "" : words.front()};
    };
  }

 private:
  test::TemporaryDirectory folder_;
};

TEST_F(Control, ClientsThatSayNothingKeepNobodyWaiting) {
  const ControlServer server{echo()};
  std::vector<std::unique_ptr<RawClient>> silent;
  for (int i = 0; i < 40; ++i) {  // more than are served at once
    silent.push_back(std::make_unique<RawClient>(path()));
    silent.back()->send("li");
  }
  const auto begin = steady_clock::now();
  EXPECT_EQ(send_order(getpid(), {"list"}).text, "list");
  EXPECT_LT(steady_clock::now() - begin, kAtOnce);
}

TEST_F(Control, AClientThatDripsIsCutOff) {
  const ControlServer server{echo()};
  const RawClient dripping{path()};
  const auto begin = steady_clock::now();
  while (!dripping.is_closed() && steady_clock::now() - begin < 30s) {
    dripping.send("x");
    std::this_thread::sleep_for(100ms);
  }
  EXPECT_LT(steady_clock::now() - begin, 5s + kAtOnce);
}

TEST_F(Control, AClientThatDoesNotReadKeepsNobodyWaiting) {
  const std::string large(4'000'000, 'x');  // more than a socket holds
  const ControlServer server{[&large](const std::vector<std::string>& words) {
    return Answer{.exit_code = 0, .text = words.front() == "large" ? large : words.front()};
  }};
  const RawClient deaf{path()};
  deaf.send("large");
  shutdown(deaf.get(), SHUT_WR);
  std::this_thread::sleep_for(100ms);
  const auto begin = steady_clock::now();
  EXPECT_EQ(send_order(getpid(), {"list"}).text, "list");
  EXPECT_LT(steady_clock::now() - begin, kAtOnce);
  EXPECT_EQ(send_order(getpid(), {"large"}).text, large);
}

TEST_F(Control, ItsEndWaitsForNoClient) {
  std::optional<ControlServer> server{echo()};
  const RawClient silent{path()};
  silent.send("list");
  std::this_thread::sleep_for(200ms);  // it has been accepted
  const auto begin = steady_clock::now();
  server.reset();
  EXPECT_LT(steady_clock::now() - begin, kAtOnce);
}

}  // namespace
}  // namespace cie::container
