#include "http_server.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <exception>
#include <list>
#include <optional>
#include <stdexcept>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <fcntl.h>
#include <fmt/format.h>

namespace cie::live {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using asio::ip::tcp;
using boost::system::error_code;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::size_t kMaxConnections = 256;
constexpr std::size_t kMaxFollowers = 16;  // pages that are open at once
constexpr std::uint32_t kMaxHeaderBytes = 8192;
constexpr std::size_t kPart = 65'536;  // of a body
constexpr int kSendBuffer =
    262'144;  // the kernel's, of a connection; by itself it grows to megabytes
constexpr seconds kRequestPatience{5};
constexpr seconds kWritePatience{5};
constexpr seconds kLastWords{1};  // how long what a refused client still sends is thrown away
constexpr seconds kSignOfLife{5};
constexpr milliseconds kAcceptAgain{100};

constexpr std::string_view kStillHere = ": still here\n\n";

// In a URL.
std::string host_of(const std::string& address) {
  return address.find(':') == std::string::npos ? address : '[' + address + ']';
}

// Programs that this one starts have no part in its connections.
void close_on_exec(int socket) { ::fcntl(socket, F_SETFD, FD_CLOEXEC); }

bool is_answered(http::verb method) {
  return method == http::verb::get || method == http::verb::head || method == http::verb::options;
}

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

// Of a request that came, but is none.
bool is_malformed(error_code error) {
  return error.category() == make_error_code(http::error::bad_method).category() &&
         error != http::error::end_of_stream && error != http::error::partial_message;
}

}  // namespace

HttpResponse text_response(std::shared_ptr<const std::string> text, std::string type) {
  HttpResponse response;
  response.fields = {{"Content-Type", std::move(type)}};
  response.size = text->size();
  response.read = [text = std::move(text)](std::uint64_t offset, std::span<char> part) {
    std::memcpy(part.data(), text->data() + offset, part.size());
  };
  return response;
}

struct HttpServer::Service {
  class Connection;
  using Connections = std::list<std::shared_ptr<Connection>>;

  Service(const std::string& address, std::uint16_t port, Handler answers);

  void listen(const std::string& address, std::uint16_t port);
  void accept();
  void take(tcp::socket socket);
  // False: there is none that may be closed.
  bool close_oldest();
  void give_sign_of_life();
  bool is_called_rightly(const http::request_header<>& request) const;

  Handler handler;
  std::string name;  // of the address, as given
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  asio::steady_timer accept_again{io};
  asio::steady_timer sign_of_life{io};
  tcp::endpoint endpoint;
  std::vector<std::string> hosts;  // what it may be called by; empty: anything
  Connections connections;         // that which has been busy for longest comes first
  std::size_t followers = 0;
  std::shared_ptr<const std::string> event;  // the last one
  std::thread serving;
};

class HttpServer::Service::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Service& service, tcp::socket socket)
      : service_(service), stream_(std::move(socket)) {}

  void read_request() {
    if (place_)
      service_.connections.splice(service_.connections.end(), service_.connections, *place_);
    parser_.emplace();
    parser_->header_limit(kMaxHeaderBytes);
    parser_->body_limit(0);
    stream_.expires_after(kRequestPatience);
    http::async_read_header(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](error_code error, std::size_t) { self->on_request(error); });
  }

  void close() {
    if (!place_) return;
    if (is_follower_) --service_.followers;
    stream_.close();
    const auto place = *place_;
    place_.reset();
    service_.connections.erase(place);  // may be the last that holds it
  }

  // The last event, or that there is none, unless the one before is still under way.
  void follow(bool is_sign_of_life) {
    if (!is_follower_ || is_writing_) return;
    if (service_.event != seen_) {
      seen_ = service_.event;
      write({seen_->data(), seen_->size()});
    } else if (is_sign_of_life) {
      write(kStillHere);
    }
  }

  bool is_follower() const { return is_follower_; }
  void set_place(Connections::iterator place) { place_ = place; }

 private:
  void on_request(error_code error) {
    if (!place_) return;
    if (error == http::error::header_limit || error == http::error::buffer_overflow) {
      refuse(431);
    } else if (error == http::error::body_limit || (!error && parser_->chunked())) {
      refuse(413);
    } else if (error) {
      is_malformed(error) ? refuse(400) : close();
    } else if (!service_.is_called_rightly(parser_->get())) {
      refuse(403);
    } else if (!is_answered(parser_->get().method())) {
      refuse(405);
    } else {
      answer();
    }
  }

  void answer() {
    const auto& request = parser_->get();
    const auto target = view(request.target());
    try {
      response_ = service_.handler(
          {.method = view(request.method_string()), .path = target.substr(0, target.find('?'))});
    } catch (const std::exception&) {
      return refuse(500);
    }
    if (response_.is_event_stream) {
      if (service_.followers == kMaxFollowers) return refuse(503);
      is_follower_ = true;
      ++service_.followers;
    }
    is_last_ = response_.status >= 400 || is_follower_ || !request.keep_alive();
    send_head(request.method() == http::verb::head);
  }

  void refuse(unsigned status) {
    response_ = {.status = status};
    is_last_ = true;
    send_head(false);
  }

  void send_head(bool is_head_only) {
    head_ = fmt::format("HTTP/1.1 {} {}\r\n", response_.status,
                        view(http::obsolete_reason(static_cast<http::status>(response_.status))));
    for (const auto& [field, value] : response_.fields)
      head_ += fmt::format("{}: {}\r\n", field, value);
    if (!is_follower_ && response_.status != 204) {
      head_ += fmt::format("Content-Length: {}\r\n", response_.size);
    }
    head_ += is_last_ ? "Connection: close\r\n\r\n" : "Connection: keep-alive\r\n\r\n";
    sent_ = is_head_only ? response_.size : 0;
    write(head_);
  }

  void write(std::string_view text) {
    is_writing_ = true;
    unwritten_ = text;
    stream_.expires_after(kWritePatience);
    stream_.async_write_some(asio::buffer(unwritten_.data(), unwritten_.size()),
                             [self = shared_from_this()](error_code error, std::size_t count) {
                               self->on_written(error, count);
                             });
  }

  void on_written(error_code error, std::size_t count) {
    if (!place_) return;
    if (error) return close();
    unwritten_.remove_prefix(count);
    if (!unwritten_.empty()) return write(unwritten_);
    is_writing_ = false;
    if (is_follower_) {
      follow(false);
    } else if (sent_ < response_.size) {
      send_part();
    } else if (is_last_) {
      part_ = {};
      end();
    } else {
      part_ = {};
      response_ = {};
      read_request();
    }
  }

  void send_part() {
    part_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(response_.size - sent_, kPart)));
    try {
      response_.read(sent_, part_);
    } catch (const std::exception&) {
      return close();
    }
    sent_ += part_.size();
    write({part_.data(), part_.size()});
  }

  // Closing a socket that still has something to read would make the kernel send a reset, which may
  // overtake the answer.
  void end() {
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    stream_.expires_after(kLastWords);
    throw_away();
  }
  void throw_away() {
    stream_.async_read_some(asio::buffer(thrown_away_),
                            [self = shared_from_this()](error_code error, std::size_t) {
                              if (!self->place_) return;
                              if (error) return self->close();
                              self->throw_away();
                            });
  }

  Service& service_;
  beast::tcp_stream stream_;
  std::optional<Connections::iterator> place_;  // empty: closed
  beast::flat_buffer buffer_{kMaxHeaderBytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
  HttpResponse response_;
  bool is_last_ = false;  // answer of this connection
  bool is_writing_ = false;
  std::string head_;
  std::vector<char> part_;
  std::uint64_t sent_ = 0;  // of the body
  std::string_view unwritten_;
  bool is_follower_ = false;
  std::shared_ptr<const std::string> seen_;
  std::array<char, 4096> thrown_away_{};
};

HttpServer::Service::Service(const std::string& address, std::uint16_t port, Handler answers)
    : handler(std::move(answers)), name(address) {
  listen(address, port);
  acceptor.non_blocking(true);
  close_on_exec(acceptor.native_handle());
  endpoint = acceptor.local_endpoint();
  if (endpoint.address().is_loopback()) {
    for (const auto& host :
         {host_of(name), host_of(endpoint.address().to_string()), std::string("localhost")})
      hosts.push_back(fmt::format("{}:{}", host, endpoint.port()));
  }
}

void HttpServer::Service::listen(const std::string& address, std::uint16_t port) {
  error_code error;
  tcp::resolver resolver(io);
  for (const auto& found :
       resolver.resolve(address, std::to_string(port), tcp::resolver::passive, error)) {
    acceptor.close(error);
    acceptor.open(found.endpoint().protocol(), error);
    // Not SO_REUSEPORT: a second server could take the same port.
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor.bind(found.endpoint(), error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (!error) return;
  }
  throw std::runtime_error(
      fmt::format("cannot listen on port {} of {}: is it taken, or not an address of this machine?",
                  port, address));
}

// All that wait, before anything is sent to those there are: who comes has not to wait for them.
void HttpServer::Service::accept() {
  acceptor.async_wait(tcp::acceptor::wait_read, [this](error_code error) {
    while (!error) {
      tcp::socket socket(io);
      acceptor.accept(socket, error);
      if (!error) take(std::move(socket));
    }
    if (error == asio::error::would_block || error == asio::error::connection_aborted) {
      return accept();
    }
    // Without descriptors it would fail at once, again and again.
    close_oldest();
    accept_again.expires_after(kAcceptAgain);
    accept_again.async_wait([this](error_code) { accept(); });
  });
}

void HttpServer::Service::take(tcp::socket socket) {
  close_on_exec(socket.native_handle());
  error_code ignored;  // the kernel's own size is right as well
  socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
  if (connections.size() >= kMaxConnections && !close_oldest()) return;
  const auto& connection =
      connections.emplace_back(std::make_shared<Connection>(*this, std::move(socket)));
  connection->set_place(std::prev(connections.end()));
  connection->read_request();
}

bool HttpServer::Service::close_oldest() {
  const auto oldest = std::ranges::find_if(
      connections, [](const auto& connection) { return !connection->is_follower(); });
  if (oldest == connections.end()) return false;
  (*oldest)->close();
  return true;
}

void HttpServer::Service::give_sign_of_life() {
  sign_of_life.expires_after(kSignOfLife);
  sign_of_life.async_wait([this](error_code) {
    // Writing may close and erase one, later: never while this loop runs.
    for (const auto& connection : connections)
      connection->follow(true);
    give_sign_of_life();
  });
}

bool HttpServer::Service::is_called_rightly(const http::request_header<>& request) const {
  if (hosts.empty()) return true;
  return request.count(http::field::host) == 1 &&
         std::ranges::find(hosts, view(request[http::field::host])) != hosts.end();
}

HttpServer::HttpServer(const std::string& address, std::uint16_t port, Handler handler)
    : service_(std::make_unique<Service>(address, port, std::move(handler))) {}

HttpServer::~HttpServer() {
  service_->io.stop();
  if (service_->serving.joinable()) service_->serving.join();
}

void HttpServer::start() {
  service_->accept();
  service_->give_sign_of_life();
  service_->serving = std::thread([&io = service_->io] { io.run(); });
}

void HttpServer::publish(std::string_view line) {
  auto event = std::make_shared<const std::string>(fmt::format("data: {}\n\n", line));
  asio::post(service_->io, [&service = *service_, event = std::move(event)]() mutable {
    service.event = std::move(event);
    for (const auto& connection : service.connections)
      connection->follow(false);
  });
}

std::string HttpServer::url() const {
  return fmt::format("http://{}:{}/", host_of(service_->name), service_->endpoint.port());
}

std::uint16_t HttpServer::port() const { return service_->endpoint.port(); }

bool HttpServer::is_loopback() const { return service_->endpoint.address().is_loopback(); }

}  // namespace cie::live
