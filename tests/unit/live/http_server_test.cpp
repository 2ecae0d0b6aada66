// The server of what cie shows, with clients that talk to its socket by hand.
#include "http_server.hpp"

#include <array>
#include <chrono>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace cie::live {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

// Below the five seconds that a connection may take, and above what a busy machine needs for
// nothing.
constexpr auto kAtOnce = 4s;

class Client {
 public:
  explicit Client(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const auto* const generic = reinterpret_cast<const sockaddr*>(&address);
    if (connect(socket_, generic, sizeof address) != 0) throw std::runtime_error("cannot connect");
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { close(socket_); }

  void send(const std::string& text) const {
    (void)::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
  }
  // What comes until it holds `end`, or the server closes the connection.
  std::string receive(const std::string& end = "\r\n\r\n") {
    std::array<char, 65536> part{};
    while (received_.find(end) == std::string::npos) {
      const auto size = recv(socket_, part.data(), part.size(), 0);
      if (size <= 0) break;
      received_.append(part.data(), static_cast<std::size_t>(size));
    }
    const auto at = received_.find(end);
    const auto count = at == std::string::npos ? received_.size() : at + end.size();
    const auto text = received_.substr(0, count);
    received_.erase(0, count);
    return text;
  }
  std::string receive_all() { return receive(std::string(1, '\0') + "never"); }

 private:
  int socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string received_;
};

std::string large() {
  std::string text;
  for (int i = 0; i < 40'000; ++i)
    text += std::to_string(i) + '\n';
  return text;
}

HttpResponse handle(const HttpRequest& request) {
  const auto text = [](std::string body) {
    return text_response(std::make_shared<const std::string>(std::move(body)), "text/plain");
  };
  if (request.path == "/small") return text("small");
  if (request.path == "/large") return text(large());
  if (request.path == "/events") {
    return {.fields = {{"Content-Type", "text/event-stream"}}, .is_event_stream = true};
  }
  if (request.path == "/throws") throw std::runtime_error("no");
  if (request.path == "/torn") {
    return {.size = 10, .read = [](std::uint64_t, std::span<char>) {
              throw std::runtime_error("cannot be read");
            }};
  }
  return {.status = 404};
}

class Server : public testing::Test {
 protected:
  void SetUp() override { server_.start(); }

  std::string request(const std::string& path, const std::string& fields = "",
                      const std::string& method = "GET") const {
    return method + ' ' + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server_.port()) +
           "\r\n" + fields + "\r\n";
  }

  HttpServer server_{"127.0.0.1", 0, handle};
};

TEST_F(Server, SendsBodiesOfAnySizeOnOneConnection) {
  Client client(server_.port());
  client.send(request("/small?query") + request("/large") + request("/large", "", "HEAD") +
              request("/small", "Connection: close\r\n"));
  EXPECT_EQ(client.receive(),
            "HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nContent-Length: 5\r\n"
            "Connection: keep-alive\r\n\r\n");
  EXPECT_EQ(client.receive("small"), "small");
  const auto length = "Content-Length: " + std::to_string(large().size());
  EXPECT_THAT(client.receive(), HasSubstr(length));
  EXPECT_EQ(client.receive("39999\n"), large());
  EXPECT_THAT(client.receive(), HasSubstr(length)) << "the answer to HEAD, which has no body";
  EXPECT_THAT(client.receive(), EndsWith("Connection: close\r\n\r\n"));
  EXPECT_EQ(client.receive_all(), "small");
}

TEST_F(Server, RefusesAndCloses) {
  const auto first_line = [this](const std::string& sent) {
    Client client(server_.port());
    client.send(sent + request("/small"));
    const auto all = client.receive_all();
    EXPECT_EQ(all.find("HTTP/1.1", 1), std::string::npos) << all;
    return all.substr(0, all.find("\r\n"));
  };
  EXPECT_EQ(first_line(request("/nothing")), "HTTP/1.1 404 Not Found");
  EXPECT_EQ(first_line(request("/throws")), "HTTP/1.1 500 Internal Server Error");
  EXPECT_EQ(first_line(request("/small", "", "POST")), "HTTP/1.1 405 Method Not Allowed");
  EXPECT_THAT(first_line(request("/small", "Content-Length: 9\r\n")), StartsWith("HTTP/1.1 413 "));
  EXPECT_THAT(first_line(request("/small", "Transfer-Encoding: chunked\r\n")),
              StartsWith("HTTP/1.1 413 "));
  EXPECT_THAT(first_line(request("/" + std::string(10'000, 'x'))), StartsWith("HTTP/1.1 431 "));
  EXPECT_THAT(first_line("no request\r\n\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(first_line("GET /small HTTP/1.1\r\nHost: evil.example\r\n\r\n"),
              StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(first_line("GET /small HTTP/1.1\r\n\r\n"), StartsWith("HTTP/1.1 403 "));
}

TEST_F(Server, ABodyThatCannotBeReadEndsTheConnection) {
  Client client(server_.port());
  client.send(request("/torn"));
  EXPECT_THAT(client.receive(), HasSubstr("Content-Length: 10"));
  EXPECT_THAT(client.receive_all(), IsEmpty());
}

TEST_F(Server, FollowersAreSentWhatIsPublished) {
  server_.publish("first");
  Client client(server_.port());
  client.send(request("/events"));
  EXPECT_THAT(client.receive(), HasSubstr("Content-Type: text/event-stream\r\n"));
  EXPECT_EQ(client.receive("\n\n"), "data: first\n\n");
  server_.publish("second");
  EXPECT_EQ(client.receive("\n\n"), "data: second\n\n");
  EXPECT_EQ(client.receive("\n\n"), ": still here\n\n");
}

TEST_F(Server, FollowersAreFew) {
  std::vector<std::unique_ptr<Client>> followers;
  for (int i = 0; i < 16; ++i) {
    followers.push_back(std::make_unique<Client>(server_.port()));
    followers.back()->send(request("/events"));
    EXPECT_THAT(followers.back()->receive(), StartsWith("HTTP/1.1 200 "));
  }
  Client one_more(server_.port());
  one_more.send(request("/events"));
  EXPECT_THAT(one_more.receive_all(), StartsWith("HTTP/1.1 503 "));
}

TEST_F(Server, ACrowdTakesNoPlaceFromFollowersAndOthers) {
  Client follower(server_.port());
  follower.send(request("/events"));
  EXPECT_THAT(follower.receive(), StartsWith("HTTP/1.1 200 "));
  std::vector<std::unique_ptr<Client>> crowd;
  for (int i = 0; i < 300; ++i) {
    crowd.push_back(std::make_unique<Client>(server_.port()));
    crowd.back()->send("GET /sm");
  }
  const auto begin = steady_clock::now();
  Client client(server_.port());
  client.send(request("/small", "Connection: close\r\n"));
  EXPECT_THAT(client.receive_all(), EndsWith("small"));
  server_.publish("to the follower");
  EXPECT_EQ(follower.receive("\n\n"), "data: to the follower\n\n");
  EXPECT_LT(steady_clock::now() - begin, kAtOnce);
}

TEST(HttpServer, EndsAtOnceWithClientsInEveryState) {
  auto server = std::make_unique<HttpServer>("127.0.0.1", 0, handle);
  server->start();
  const auto host = "Host: localhost:" + std::to_string(server->port()) + "\r\n\r\n";
  Client silent(server->port());
  Client following(server->port());
  following.send("GET /events HTTP/1.1\r\n" + host);
  EXPECT_THAT(following.receive(), StartsWith("HTTP/1.1 200 "));
  Client deaf(server->port());
  for (int i = 0; i < 50; ++i)
    deaf.send("GET /large HTTP/1.1\r\n" + host);
  const auto begin = steady_clock::now();
  server.reset();
  EXPECT_LT(steady_clock::now() - begin, kAtOnce);
  EXPECT_THAT(following.receive_all(), IsEmpty());
}

TEST(HttpServer, IsNotStartedOrTwice) {
  const HttpServer first("127.0.0.1", 0, handle);
  EXPECT_THROW(HttpServer("127.0.0.1", first.port(), handle), std::runtime_error);
  EXPECT_THROW(HttpServer("192.0.2.1", 0, handle), std::runtime_error) << "no address of ours";
  EXPECT_TRUE(first.is_loopback());
}

TEST(HttpServer, AnswersEverybodyWhereItIsOpen) {
  HttpServer server("0.0.0.0", 0, handle);
  server.start();
  EXPECT_FALSE(server.is_loopback());
  Client client(server.port());
  client.send("GET /small HTTP/1.1\r\nHost: robot.example\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(client.receive_all(), EndsWith("small"));
}

}  // namespace
}  // namespace cie::live
