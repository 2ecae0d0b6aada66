#include "live_server.hpp"

#include "html_files.hpp"
#include "local_http.hpp"
#include "snapshot_json.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <httplib.h>

namespace cie::live {
namespace {

using std::chrono::milliseconds;

constexpr int kMaxFollowers = 16;  // pages that are open at once
constexpr int kOtherThreads = 8;
constexpr milliseconds kKeepAlive{5000};
constexpr std::time_t kWritePatience = 5;  // seconds; who reads nothing for longer is cut off

bool is_loopback(const std::string& address) {
  return address == "localhost" || address == "::1" || address.rfind("127.", 0) == 0;
}

// In a URL.
std::string host_of(const std::string& address) {
  return address.find(':') == std::string::npos ? address : '[' + address + ']';
}

void send_text(httplib::Response& response, std::string_view text, const char* type) {
  response.set_header("Cache-Control", "no-store");
  response.set_header("X-Content-Type-Options", "nosniff");
  response.set_content(std::string(text), type);
}

}  // namespace

struct LiveServer::Server {
  std::string address;
  int port = 0;
  httplib::Server http;
  std::thread serving;

  std::mutex mutex;
  std::condition_variable published;
  std::string line;  // the last snapshot
  std::string metrics_text;
  std::uint64_t number = 0;  // of it
  bool is_ending = false;

  Metrics metrics;
  std::atomic<int> followers = 0;

  bool is_for_us(const httplib::Request& request) const {
    if (!is_loopback(address)) return true;
    return viewer_export::is_called_by_loopback(request, host_of(address), port);
  }

  // One event of the stream, when there is one the follower has not had. False: it is over.
  bool send_next(std::uint64_t& seen, httplib::DataSink& sink) {
    std::string text = ": still here\n\n";
    {
      std::unique_lock lock(mutex);
      published.wait_for(lock, kKeepAlive, [&] { return is_ending || number != seen; });
      if (is_ending) return false;
      if (number != seen) text = "data: " + line + "\n\n";
      seen = number;
    }
    return sink.write(text.data(), text.size());
  }

  void follow(httplib::Response& response) {
    if (followers.fetch_add(1) >= kMaxFollowers) {
      --followers;
      response.status = 503;
      return;
    }
    response.set_header("Cache-Control", "no-store");
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, seen = std::uint64_t{0}](std::size_t, httplib::DataSink& sink) mutable {
          return send_next(seen, sink);
        },
        [this](bool) { --followers; });
  }

  void set_up() {
    http.set_socket_options(viewer_export::use_port_alone);
    http.set_write_timeout(kWritePatience);
    http.new_task_queue = [] { return new httplib::ThreadPool(kMaxFollowers + kOtherThreads); };
    http.set_pre_routing_handler(
        [this](const httplib::Request& request, httplib::Response& response) {
          if (is_for_us(request)) return httplib::Server::HandlerResponse::Unhandled;
          response.status = 403;
          return httplib::Server::HandlerResponse::Handled;
        });
    http.Get("/", [](const httplib::Request&, httplib::Response& response) {
      response.set_header("Content-Security-Policy",
                          "default-src 'none'; script-src 'self'; style-src 'self'; connect-src "
                          "'self'; img-src data:; base-uri 'none'; form-action 'none'; "
                          "frame-ancestors 'none'");
      send_text(response, viewer_export::kLiveHtml, "text/html; charset=utf-8");
    });
    http.Get("/live.css", [](const httplib::Request&, httplib::Response& response) {
      send_text(response,
                std::string(viewer_export::kReportCss) + std::string(viewer_export::kLiveCss),
                "text/css; charset=utf-8");
    });
    http.Get("/live.js", [](const httplib::Request&, httplib::Response& response) {
      send_text(response, viewer_export::kLiveJs, "text/javascript; charset=utf-8");
    });
    http.Get("/events",
             [this](const httplib::Request&, httplib::Response& response) { follow(response); });
    http.Get("/metrics", [this](const httplib::Request&, httplib::Response& response) {
      const std::scoped_lock lock(mutex);
      send_text(response, metrics_text, "text/plain; version=0.0.4; charset=utf-8");
    });
    http.Get("/snapshot.json", [this](const httplib::Request&, httplib::Response& response) {
      const std::scoped_lock lock(mutex);
      if (line.empty()) {
        response.status = 503;
        return;
      }
      send_text(response, line + '\n', "application/json");
    });
  }
};

LiveServer::LiveServer(const std::string& address, int port) : server_(std::make_unique<Server>()) {
  auto& server = *server_;
  server.address = address;
  server.metrics_text = server.metrics.text();
  server.set_up();
  server.port = port == 0                                 ? server.http.bind_to_any_port(address)
                : server.http.bind_to_port(address, port) ? port
                                                          : -1;
  if (server.port < 0) {
    throw std::runtime_error(fmt::format(
        "cannot listen on port {} of {}: is it taken, or not an address of this machine?", port,
        address));
  }
  server.serving = std::thread([&server] { server.http.listen_after_bind(); });
  while (!server.http.is_running())  // it cannot be stopped before
    std::this_thread::sleep_for(milliseconds(1));
}

LiveServer::~LiveServer() {
  {
    const std::scoped_lock lock(server_->mutex);
    server_->is_ending = true;
  }
  server_->published.notify_all();
  server_->http.stop();
  server_->serving.join();
}

std::string LiveServer::url() const {
  return fmt::format("http://{}:{}/", host_of(server_->address), server_->port);
}

void LiveServer::publish(const Snapshot& snapshot) {
  auto line = json_line(snapshot, true);
  server_->metrics.add(snapshot);
  auto metrics = server_->metrics.text();
  {
    const std::scoped_lock lock(server_->mutex);
    server_->line = std::move(line);
    server_->metrics_text = std::move(metrics);
    ++server_->number;
  }
  server_->published.notify_all();
}

}  // namespace cie::live
