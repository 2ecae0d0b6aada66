#include "relay_daemon.hpp"

#include "error.hpp"
#include "file_descriptor.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

constexpr int kAttempts = 5;
constexpr std::chrono::seconds kStartPatience{10};
constexpr std::chrono::seconds kStopPatience{10};
constexpr std::chrono::milliseconds kPollInterval{10};

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

struct FreePort {
  FileDescriptor holder;  // nobody else is given the port while this is open
  std::uint16_t number = 0;
};

FreePort free_port() {
  FreePort port{.holder = FileDescriptor(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0))};
  auto address = loopback(0);
  socklen_t size = sizeof address;
  if (!port.holder.is_open() ||
      bind(port.holder.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
      getsockname(port.holder.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw system_error("cannot find a free port on 127.0.0.1", errno);
  }
  port.number = ntohs(address.sin_port);
  return port;
}

bool is_listening(std::uint16_t port) {
  const FileDescriptor probe(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const auto address = loopback(port);
  return connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

}  // namespace

RelayDaemon::RelayDaemon() {
  std::string name = (fs::temp_directory_path() / "cie-relay-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    throw system_error("cannot create a directory like " + in_quotes(name), errno);
  }
  directory_ = name;
  try {
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      if (start()) return;
    }
  } catch (...) {
    stop();
    throw;
  }
  std::ifstream log(directory_ / "relayd.log");
  std::string line;
  std::getline(log, line);
  stop();
  throw RecordError("the relay daemon of LTTng did not start: " + line);
}

RelayDaemon::~RelayDaemon() { stop(); }

std::string RelayDaemon::address(const char* protocol, std::uint16_t port) {
  return std::string(protocol) + "://127.0.0.1:" + std::to_string(port);
}

bool RelayDaemon::start() {
  {
    const auto control = free_port();
    const auto data = free_port();
    const auto live = free_port();
    control_port_ = control.number;
    data_port_ = data.number;
    live_port_ = live.number;
  }
  const char* program = std::getenv("LTTNG_RELAYD_PATH");
  try {
    process_.emplace(
        std::vector<std::string>{program != nullptr ? program : "lttng-relayd",
                                 "--control-port=" + control_url(), "--data-port=" + data_url(),
                                 "--live-port=" + address("tcp", live_port_),
                                 "--output=" + (directory_ / "streams").string()},
        ChildOptions{.environment = {},
                     .is_detached = true,
                     .dies_with_parent = true,
                     .log_file = directory_ / "relayd.log"});
  } catch (const RecordError& error) {
    throw RecordError(std::string(error.what()) +
                      " (the relay daemon of LTTng: install lttng-tools)");
  }
  const auto deadline = steady_clock::now() + kStartPatience;
  while (steady_clock::now() < deadline) {
    if (process_->poll()) return false;
    if (is_listening(control_port_) && is_listening(data_port_) && is_listening(live_port_)) {
      return true;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  return false;
}

void RelayDaemon::stop() noexcept {
  if (process_) {
    process_->kill(SIGTERM);
    const auto deadline = steady_clock::now() + kStopPatience;
    while (!process_->poll() && steady_clock::now() < deadline)
      std::this_thread::sleep_for(kPollInterval);
    process_->kill(SIGKILL);
  }
  std::error_code ignored;  // a left-over temporary directory is not worth a failure
  fs::remove_all(directory_, ignored);
}

}  // namespace cie::record
