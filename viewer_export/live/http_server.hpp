// HTTP/1.1 for what this program shows: things to fetch, and one stream of events to follow.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::live {

struct HttpRequest {
  std::string_view method;  // GET, HEAD or OPTIONS
  std::string_view path;    // without a query
};

struct HttpResponse {
  unsigned status = 200;
  std::vector<std::pair<std::string, std::string>> fields = {};  // header fields
  // The body: so many bytes, of which read() copies those from an offset on. It may throw: the
  // connection is closed then.
  std::uint64_t size = 0;
  std::function<void(std::uint64_t offset, std::span<char> part)> read = {};
  bool is_event_stream = false;  // in place of a body: what publish() is given from now on
};

// The text as a body; whoever is served shares it.
HttpResponse text_response(std::shared_ptr<const std::string> text, std::string type);

// A thread of its own serves all connections, so that none waits for another:
// - A request has five seconds to come, and eight KiB; who reads nothing for five seconds is cut off.
// - No request has a body. One that is refused, for whatever reason, ends its connection: what comes
//   after it is not taken for the next request.
// - Of too many connections the one goes whose request, or answer, has been going on for longest.
// - On a loopback address only those are answered who call it by that, in every request: a foreign
//   web page whose name was made to lead here is refused.
class HttpServer {
 public:
  // Called by the server's thread, one at a time.
  using Handler = std::function<HttpResponse(const HttpRequest&)>;

  // Listens from now on; clients wait until start(). Port 0: any free one. Throws
  // std::runtime_error.
  HttpServer(const std::string& address, std::uint16_t port, Handler handler);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  // The thread that serves leaves those signals alone that the caller has blocked.
  void start();
  // The data of one server-sent event, a line. A follower that comes later is sent the last one;
  // one that is slower than they come misses some.
  void publish(std::string_view line);

  // "http://127.0.0.1:9464/"
  std::string url() const;
  std::uint16_t port() const;
  // Whether only this machine reaches it.
  bool is_loopback() const;

 private:
  struct Service;
  std::unique_ptr<Service> service_;
};

}  // namespace cie::live
