#include "live_server.hpp"

#include "html/html_files.hpp"
#include "http_server.hpp"
#include "snapshot_json.hpp"

#include <mutex>
#include <string_view>
#include <utility>

namespace cie::live {
namespace {

using Text = std::shared_ptr<const std::string>;

HttpResponse answer(Text text, const char* type) {
  auto response = text_response(std::move(text), type);
  response.fields.emplace_back("Cache-Control", "no-store");
  response.fields.emplace_back("X-Content-Type-Options", "nosniff");
  return response;
}

HttpResponse answer(std::string text, const char* type) {
  return answer(std::make_shared<const std::string>(std::move(text)), type);
}

HttpResponse page() {
  auto response = answer(std::string(viewer_export::kLiveHtml), "text/html; charset=utf-8");
  response.fields.emplace_back(
      "Content-Security-Policy",
      "default-src 'none'; script-src 'self'; style-src 'self'; connect-src "
      "'self'; img-src data:; base-uri 'none'; form-action 'none'; "
      "frame-ancestors 'none'");
  return response;
}

HttpResponse event_stream() {
  return {.fields = {{"Content-Type", "text/event-stream"}, {"Cache-Control", "no-store"}},
          .is_event_stream = true};
}

}  // namespace

struct LiveServer::Server {
  Server(const std::string& address, std::uint16_t port)
      : http(address, port, [this](const HttpRequest& request) { return response_to(request); }) {}

  HttpResponse response_to(const HttpRequest& request) {
    if (request.method == "OPTIONS") return {.status = 405};
    if (request.path == "/") return page();
    if (request.path == "/live.css") {
      return answer(std::string(viewer_export::kReportCss) + std::string(viewer_export::kLiveCss),
                    "text/css; charset=utf-8");
    }
    if (request.path == "/live.js") {
      return answer(std::string(viewer_export::kLiveJs), "text/javascript; charset=utf-8");
    }
    if (request.path == "/events") return event_stream();
    const std::scoped_lock lock(mutex);
    if (request.path == "/metrics") {
      return answer(metrics_text, "text/plain; version=0.0.4; charset=utf-8");
    }
    if (request.path == "/snapshot.json") {
      return line ? answer(line, "application/json") : HttpResponse{.status = 503};
    }
    return {.status = 404};
  }

  Metrics metrics;
  std::mutex mutex;
  Text line;  // the last snapshot; null: none yet
  Text metrics_text;
  HttpServer http;  // the last member: its thread uses the others
};

LiveServer::LiveServer(const std::string& address, std::uint16_t port)
    : server_(std::make_unique<Server>(address, port)) {
  server_->metrics_text = std::make_shared<const std::string>(server_->metrics.text());
  server_->http.start();
}

LiveServer::~LiveServer() = default;

std::string LiveServer::url() const { return server_->http.url(); }

bool LiveServer::is_loopback() const { return server_->http.is_loopback(); }

void LiveServer::publish(const Snapshot& snapshot) {
  const auto line = json_line(snapshot, true);
  server_->metrics.add(snapshot);
  auto document = std::make_shared<const std::string>(line + '\n');
  auto metrics = std::make_shared<const std::string>(server_->metrics.text());
  {
    const std::scoped_lock lock(server_->mutex);
    server_->line = std::move(document);
    server_->metrics_text = std::move(metrics);
  }
  server_->http.publish(line);
}

}  // namespace cie::live
