#include "control.hpp"

#include "base/text.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace cie::container {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxRequest = 65'536;
constexpr std::size_t kMaxAnswer = std::size_t{4} << 20U;
constexpr std::chrono::seconds kPatience{5};  // for a request as a whole, and for an answer
constexpr std::size_t kMaxClients = 32;
constexpr std::string_view kSuffix = ".sock";

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error{what + ": " + std::generic_category().message(errno)};
}

// $XDG_RUNTIME_DIR/cie-run, else /tmp/cie-run-<user id>: ours, and nobody else's to enter.
fs::path folder() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  fs::path path = runtime != nullptr && *runtime == '/'
                      ? fs::path{runtime} / "cie-run"
                      : fs::path{fmt::format("/tmp/cie-run-{}", geteuid())};
  if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) fail("cannot make " + path.string());
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) fail("cannot use " + path.string());
  if (!S_ISDIR(status.st_mode) || status.st_uid != geteuid() || (status.st_mode & 0077U) != 0) {
    throw std::runtime_error{path.string() +
                             " is not a folder of this user alone: remove it, or set its mode to "
                             "0700"};
  }
  return path;
}

sockaddr_un address_of(const fs::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string text = path.string();
  if (text.size() >= sizeof address.sun_path) {
    throw std::runtime_error{text +
                             " is too long for a socket: set XDG_RUNTIME_DIR to a shorter "
                             "path"};
  }
  std::memcpy(address.sun_path, text.c_str(), text.size() + 1);
  return address;
}

const sockaddr* generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);  // as the sockets interface wants it
}

// Up to the end of what is sent; false if it is more than `most` or does not come.
bool receive_all(int connection, std::string& text, std::size_t most) {
  char buffer[4096];
  for (;;) {
    const ssize_t size = recv(connection, buffer, sizeof buffer, 0);
    if (size == 0) return true;
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 || text.size() + static_cast<std::size_t>(size) > most) return false;
    text.append(buffer, static_cast<std::size_t>(size));
  }
}

bool send_all(int connection, std::string_view text) {
  while (!text.empty()) {
    const ssize_t size = send(connection, text.data(), text.size(), MSG_NOSIGNAL);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(size));
  }
  return true;
}

std::vector<std::string> split(const std::string& request) {
  std::vector<std::string> words;
  for (std::size_t begin = 0; begin < request.size();) {
    const std::size_t end = std::min(request.find('\0', begin), request.size());
    words.push_back(request.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

bool is_running(int pid) { return kill(pid, 0) == 0 || errno == EPERM; }

// The process ids of containers that can be reached.
std::vector<int> running_containers(const fs::path& in) {
  std::vector<int> pids;
  for (const auto& entry : fs::directory_iterator{in}) {
    const std::string name = entry.path().filename();
    if (!name.ends_with(kSuffix)) continue;
    const auto pid =
        parse_number<int>(std::string_view{name}.substr(0, name.size() - kSuffix.size()));
    if (pid && *pid > 0 && is_running(*pid)) pids.push_back(*pid);
  }
  std::ranges::sort(pids);
  return pids;
}

int only_one(const std::vector<int>& pids) {
  if (pids.empty()) throw std::invalid_argument{"no container of this user is running"};
  if (pids.size() == 1) return pids.front();
  throw std::invalid_argument{fmt::format(
      "several containers are running: choose one with --pid: {}", fmt::join(pids, " "))};
}

fs::path socket_of(const fs::path& in, int pid) { return in / fmt::format("{}{}", pid, kSuffix); }

using std::chrono::steady_clock;

// For poll(): not too early, and -1 for never.
int milliseconds_until(steady_clock::time_point deadline) {
  if (deadline == steady_clock::time_point::max()) return -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - steady_clock::now());
  return static_cast<int>(std::max<std::chrono::milliseconds::rep>(left.count(), 0));
}

// A connection that gives an order: first its request comes, then its answer goes, each as far as
// it can without waiting.
class Client {
 public:
  explicit Client(FileDescriptor connection) : connection_(std::move(connection)) {}

  pollfd wanted() const {
    const short events = is_answered_ ? POLLOUT : POLLIN;
    return {.fd = connection_.get(), .events = events, .revents = 0};
  }
  steady_clock::time_point deadline() const { return deadline_; }
  bool is_over() const { return is_over_; }

  // There is something to read, or room to write.
  void go_on(const ControlServer::Handler& handler) {
    if (!is_answered_) receive(handler);
    if (is_answered_ && !is_over_) send();
  }

 private:
  void receive(const ControlServer::Handler& handler) {
    char buffer[4096];
    const ssize_t size = recv(connection_.get(), buffer, sizeof buffer, 0);
    if (size < 0) {
      is_over_ = !is_passing(errno);
    } else if (request_.size() + static_cast<std::size_t>(size) > kMaxRequest) {
      is_over_ = true;
    } else if (size > 0) {
      request_.append(buffer, static_cast<std::size_t>(size));
    } else {
      const Answer answer = handler(split(request_));
      answer_ = std::to_string(answer.exit_code) + answer.text;
      is_answered_ = true;
      deadline_ = steady_clock::now() + kPatience;
    }
  }

  void send() {
    const std::string_view rest = std::string_view{answer_}.substr(sent_);
    const ssize_t size = ::send(connection_.get(), rest.data(), rest.size(), MSG_NOSIGNAL);
    if (size < 0) {
      is_over_ = !is_passing(errno);
    } else {
      sent_ += static_cast<std::size_t>(size);
      is_over_ = sent_ == answer_.size();
    }
  }

  static bool is_passing(int error) { return error == EINTR || error == EAGAIN; }

  FileDescriptor connection_;
  steady_clock::time_point deadline_ = steady_clock::now() + kPatience;
  std::string request_;
  std::string answer_;
  std::size_t sent_ = 0;
  bool is_answered_ = false;
  bool is_over_ = false;
};

}  // namespace

ControlServer::ControlServer(Handler handler) : handler_(std::move(handler)) {
  path_ = socket_of(folder(), getpid());
  const sockaddr_un address = address_of(path_);
  unlink(path_.c_str());  // of a process that had this id before
  socket_ = FileDescriptor{socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)};
  stop_ = FileDescriptor{eventfd(0, EFD_CLOEXEC)};
  constexpr int kBacklog = 8;
  if (!socket_.is_open() || !stop_.is_open() || fchmod(socket_.get(), 0600) != 0 ||
      bind(socket_.get(), generic(address), sizeof address) != 0 ||
      ::listen(socket_.get(), kBacklog) != 0) {
    fail("cannot listen on " + path_.string());
  }
  thread_ = std::thread{[this] { listen(); }};
}

ControlServer::~ControlServer() {
  unlink(path_.c_str());
  eventfd_write(stop_.get(), 1);
  thread_.join();
}

void ControlServer::listen() {
  pthread_setname_np(pthread_self(), "cie-control");
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  std::vector<Client> clients;  // the oldest first
  for (;;) {
    std::vector<pollfd> wanted{{.fd = stop_.get(), .events = POLLIN, .revents = 0},
                               {.fd = socket_.get(), .events = POLLIN, .revents = 0}};
    auto next_deadline = steady_clock::time_point::max();
    for (const Client& client : clients) {
      wanted.push_back(client.wanted());
      next_deadline = std::min(next_deadline, client.deadline());
    }
    if (poll(wanted.data(), wanted.size(), milliseconds_until(next_deadline)) < 0)
      continue;  // EINTR
    if (wanted[0].revents != 0) return;
    for (std::size_t i = 0; i < clients.size(); ++i) {
      if (wanted[i + 2].revents != 0) clients[i].go_on(handler_);
    }
    std::erase_if(clients, [now = steady_clock::now()](const Client& client) {
      return client.is_over() || client.deadline() <= now;
    });
    if (wanted[1].revents == 0) continue;
    FileDescriptor connection{
        accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)};
    if (connection.get() < 0) continue;
    if (clients.size() == kMaxClients) clients.erase(clients.begin());
    clients.emplace_back(std::move(connection));
  }
}

Answer send_order(int pid, const std::vector<std::string>& words) {
  const fs::path in = folder();
  const fs::path path = socket_of(in, pid > 0 ? pid : only_one(running_containers(in)));
  const sockaddr_un address = address_of(path);
  const FileDescriptor connection{socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  if (connection.get() < 0 || connect(connection.get(), generic(address), sizeof address) != 0) {
    fail("cannot reach a container at " + path.string());
  }
  std::string request;
  for (const std::string& word : words) {
    request += word;
    request += '\0';
  }
  std::string text;
  if (!send_all(connection.get(), request) || shutdown(connection.get(), SHUT_WR) != 0 ||
      !receive_all(connection.get(), text, kMaxAnswer) || text.empty()) {
    throw std::runtime_error{"the container at " + path.string() + " gave no answer"};
  }
  return {.exit_code = text.front() - '0', .text = text.substr(1)};
}

}  // namespace cie::container
