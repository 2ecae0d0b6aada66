// Orders to a running container, from another terminal of the same user.
//
// A container listens on a socket in a folder that only its user may enter, so whoever can write to
// it could as well have started it. A request is words separated by zero bytes, up to the end of
// what is sent; the answer is one digit, the client's exit code, and text.
#pragma once

#include "base/file_descriptor.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace cie::container {

struct Answer {
  int exit_code = 0;
  std::string text;
};

// Listens on a thread of its own until destroyed, which waits for an order under way, and for no
// client. A client has five seconds for its request as a whole, and as long for its answer; none
// waits for another's. Orders are followed one after the other.
class ControlServer {
 public:
  // Called on the server's thread; must not throw.
  using Handler = std::function<Answer(const std::vector<std::string>& words)>;

  // Throws std::runtime_error when the socket cannot be made.
  explicit ControlServer(Handler handler);
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  ~ControlServer();

 private:
  void listen();

  Handler handler_;
  std::filesystem::path path_;
  FileDescriptor socket_;
  FileDescriptor stop_;  // an eventfd
  std::thread thread_;
};

// Sends an order to the container of this process id; 0: to the only one there is. Throws
// std::invalid_argument if that leaves a choice or nothing, std::runtime_error if it cannot be
// reached.
Answer send_order(int pid, const std::vector<std::string>& words);

}  // namespace cie::container
