#include "lttng/relay_daemon.hpp"

#include <cie/tracepoints/utf8.hpp>

#include "base/file_descriptor.hpp"
#include "system/error.hpp"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

constexpr int kAttempts = 5;
constexpr std::uint16_t kPorts = 3;
constexpr std::chrono::seconds kRelayStartPatience{10};
constexpr std::chrono::seconds kRelayStopPatience{10};
constexpr std::chrono::milliseconds kRelayPollInterval{10};

// A socket at the address, so that nobody else is given it; port 0: any. An errno if it is taken.
struct Holder {
  FileDescriptor socket;
  std::uint16_t port = 0;
  int error = 0;
};

Holder hold(const NetworkAddress& address) {
  const auto found = look_up(address, AI_PASSIVE);
  if (!found.list) throw RecordError("cannot listen on " + address.text() + ": " + found.error);
  const addrinfo* const list = found.list.get();
  Holder holder{.socket = FileDescriptor(
                    socket(list->ai_family, SOCK_STREAM | SOCK_CLOEXEC, list->ai_protocol))};
  const int yes = 1;
  static_cast<void>(setsockopt(holder.socket.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes));
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  if (!holder.socket.is_open() || bind(holder.socket.get(), list->ai_addr, list->ai_addrlen) != 0 ||
      getsockname(holder.socket.get(), reinterpret_cast<sockaddr*>(&bound), &size) != 0) {
    holder.error = errno;
    return holder;
  }
  // Both kinds of address have the port at the same place.
  holder.port = ntohs(reinterpret_cast<const sockaddr_in*>(&bound)->sin_port);
  return holder;
}

// The first of three free ports that follow each other. Empty: not after the one that was found.
// Throws if a port that was asked for is not free.
std::optional<std::uint16_t> three_ports(const NetworkAddress& address) {
  const bool is_any = address.port == 0;
  const Holder first = hold(address);
  if (is_any && first.port > UINT16_MAX - kPorts) return std::nullopt;
  NetworkAddress each = address;
  for (std::uint16_t step = 0; step < kPorts; ++step) {
    if (step > 0) each.port = static_cast<std::uint16_t>(first.port + step);
    const int error = step == 0 ? first.error : hold(each).error;
    if (error == 0) continue;
    if (is_any && step > 0) return std::nullopt;
    throw system_error("cannot listen on " + each.text() +
                           (error == EADDRINUSE ? " (a relay daemon that runs already?)" : ""),
                       error);
  }
  return first.port;
}

// Peers that are gone without a word are noticed, after eleven seconds, a little later than a
// recorder gives up: so what they sent is finished.
const std::vector<std::pair<std::string, std::string>>& patience() {
  static const std::vector<std::pair<std::string, std::string>> variables{
      {"LTTNG_RELAYD_TCP_KEEP_ALIVE", "1"},
      {"LTTNG_RELAYD_TCP_KEEP_ALIVE_IDLE_TIME", "3"},
      {"LTTNG_RELAYD_TCP_KEEP_ALIVE_PROBE_INTERVAL", "2"},
      {"LTTNG_RELAYD_TCP_KEEP_ALIVE_MAX_PROBE_COUNT", "4"}};
  return variables;
}

}  // namespace

RelayDaemon::RelayDaemon() : address_({.host = "127.0.0.1", .port = 0}) { start_somewhere(); }

RelayDaemon::RelayDaemon(const NetworkAddress& address, const fs::path& output)
    : output_(output), address_(address) {
  start_somewhere();
}

void RelayDaemon::start_somewhere() {
  directory_.emplace(fs::temp_directory_path(), "cie-relay-");
  if (output_.empty()) output_ = directory_->path() / "streams";
  try {
    const NetworkAddress wanted = address_;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const auto port = three_ports(wanted);
      address_.port = port.value_or(0);
      if (port && start()) return;
    }
    throw RecordError("the relay daemon of LTTng did not start: " + how_it_ended());
  } catch (...) {
    stop();
    throw;
  }
}

RelayDaemon::~RelayDaemon() { stop(); }

NetworkAddress RelayDaemon::next(std::uint16_t step) const {
  NetworkAddress result = address_;
  result.port = static_cast<std::uint16_t>(result.port + step);
  return result;
}

std::string RelayDaemon::last_words() const {
  std::ifstream log(directory_->path() / "relayd.log");
  std::string line;
  std::string last;
  while (std::getline(log, line)) {
    if (!line.empty()) last = line;
  }
  return printable(last);  // it may name what another machine sent
}

std::string RelayDaemon::how_it_ended() {
  const auto status = process_ ? process_->poll() : std::nullopt;
  const auto words = last_words();
  const auto end = status ? "it " + describe(*status) : words.empty() ? "it said nothing" : "";
  return end + (end.empty() || words.empty() ? "" : ": ") + words;
}

bool RelayDaemon::start() {
  const char* program = std::getenv("LTTNG_RELAYD_PATH");
  try {
    process_.emplace(
        std::vector<std::string>{program != nullptr ? program : "lttng-relayd",
                                 "--control-port=" + control_url(), "--data-port=" + data_url(),
                                 "--live-port=" + next(2).url(), "--output=" + output_.string(),
                                 "--group-output-by-host"},
        ChildOptions{.environment = patience(),
                     .is_detached = true,
                     .dies_with_parent = true,
                     .outlives_file_limit = true,
                     .log_file = directory_->path() / "relayd.log"});
  } catch (const RecordError& error) {
    throw RecordError(std::string(error.what()) +
                      " (the relay daemon of LTTng: install lttng-tools)");
  }
  directory_->note_daemon(process_->pid());
  const auto deadline = steady_clock::now() + kRelayStartPatience;
  const auto is_listening = [this](std::uint16_t step) {
    return connect_to(next(step), kRelayPollInterval).socket.is_open();
  };
  while (steady_clock::now() < deadline) {
    if (process_->poll()) return false;
    if (is_listening(0) && is_listening(1) && is_listening(2)) return true;
    std::this_thread::sleep_for(kRelayPollInterval);
  }
  return false;
}

void RelayDaemon::stop() noexcept {
  if (process_) {
    process_->kill(SIGTERM);
    const auto deadline = steady_clock::now() + kRelayStopPatience;
    while (!process_->poll() && steady_clock::now() < deadline)
      std::this_thread::sleep_for(kRelayPollInterval);
    process_->kill(SIGKILL);
    process_.reset();
  }
  directory_.reset();
}

}  // namespace cie::record
