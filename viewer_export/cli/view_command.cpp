#include <cie/viewer_export/html_report.hpp>
#include <cie/viewer_export/perfetto_export.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "spool.hpp"

#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <httplib.h>
#include <signal.h>
#include <sys/socket.h>

namespace cie::cli {
namespace {

constexpr const char* kDescription =
    "Shows a trace in the browser: the report as a page, and the timeline in Perfetto's viewer.\n"
    "Serves both on this machine's loopback address only, until Ctrl-C.";

constexpr const char* kFooter =
    "Examples:\n"
    "  cie view recordings/latest\n"
    "  cie view run1 --spec app.yaml --port 0        any free port, for the report's page only\n"
    "\n"
    "ui.perfetto.dev may fetch from 127.0.0.1:9001 and no other port; nothing is uploaded, its\n"
    "script runs in your browser. To keep files instead: cie report -f html, cie export --to "
    "perfetto.\n"
    "Exit codes: 0 ended by Ctrl-C, 2 wrong usage or spec, 4 trace unreadable or port taken.\n";

constexpr const char* kHost = "127.0.0.1";
constexpr int kPerfettoPort =
    9001;  // the only one that the viewer's content security policy allows
constexpr const char* kViewer = "https://ui.perfetto.dev";

// Tells two observers.
class Both final : public analysis::Observer {
 public:
  Both(analysis::Observer& first, analysis::Observer& second) : first_(first), second_(second) {}
  void on_instance(const analysis::Instance& instance) override {
    first_.on_instance(instance);
    second_.on_instance(instance);
  }
  void on_publication(const analysis::Publication& publication) override {
    first_.on_publication(publication);
    second_.on_publication(publication);
  }
  void on_sched_slice(const analysis::SchedSlice& slice) override {
    first_.on_sched_slice(slice);
    second_.on_sched_slice(slice);
  }
  void on_waking(const analysis::Waking& waking) override {
    first_.on_waking(waking);
    second_.on_waking(waking);
  }

 private:
  analysis::Observer& first_;
  analysis::Observer& second_;
};

// Writes into a file without a name.
class SpoolBuffer final : public std::streambuf {
 public:
  explicit SpoolBuffer(viewer_export::Spool& spool) : spool_(spool) {
    setp(buffer_.data(), buffer_.data() + buffer_.size());
  }

 protected:
  int_type overflow(int_type c) override {
    sync();
    if (!traits_type::eq_int_type(c, traits_type::eof())) {
      *pptr() = traits_type::to_char_type(c);
      pbump(1);
    }
    return traits_type::not_eof(c);
  }
  int sync() override {
    spool_.append({pbase(), static_cast<std::size_t>(pptr() - pbase())});
    setp(buffer_.data(), buffer_.data() + buffer_.size());
    return 0;
  }

 private:
  viewer_export::Spool& spool_;
  std::array<char, 65536> buffer_{};
};

// What is served.
struct Pages {
  std::string report;
  viewer_export::Spool timeline{{}};
};

// Only who names this machine by its loopback address: another site's name may lead here, too.
bool is_for_us(const httplib::Request& request, int port) {
  const std::string host = request.get_header_value("Host");
  return host == fmt::format("{}:{}", kHost, port) || host == fmt::format("localhost:{}", port);
}

void set_up(httplib::Server& server, const Pages& pages, const int& port) {
  server.set_pre_routing_handler(
      [&port](const httplib::Request& request, httplib::Response& response) {
        if (is_for_us(request, port)) return httplib::Server::HandlerResponse::Unhandled;
        response.status = 403;
        return httplib::Server::HandlerResponse::Handled;
      });
  server.Get("/", [&pages](const httplib::Request&, httplib::Response& response) {
    response.set_header("Cache-Control", "no-store");
    response.set_content(pages.report, "text/html; charset=utf-8");
  });
  const auto allow_viewer = [](httplib::Response& response) {
    response.set_header("Access-Control-Allow-Origin", kViewer);
    response.set_header("Access-Control-Allow-Private-Network", "true");
    response.set_header("Cache-Control", "no-store");
  };
  server.Options("/trace.pftrace",
                 [allow_viewer](const httplib::Request&, httplib::Response& response) {
                   allow_viewer(response);
                   response.set_header("Access-Control-Allow-Methods", "GET");
                   response.status = 204;
                 });
  server.Get("/trace.pftrace",
             [allow_viewer, &pages](const httplib::Request&, httplib::Response& response) {
               allow_viewer(response);
               response.set_content_provider(
                   pages.timeline.size(), "application/octet-stream",
                   [&pages](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                     std::array<char, 65536> part{};
                     const auto piece = std::span(part).first(std::min(length, part.size()));
                     pages.timeline.read(offset, piece);
                     return sink.write(piece.data(), piece.size());
                   });
             });
}

// Throws UsageError.
int port_of(const std::string& text) {
  std::uint16_t port = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc{} || rest != text.data() + text.size() || text.empty()) {
    throw UsageError("--port takes a number from 0 (any free one) to 65535: \"" + text + '"');
  }
  return port;
}

// SO_REUSEADDR only: httplib's default would let a second one take the same port.
void use_port_alone(int socket) {
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

void make(const std::vector<std::filesystem::path>& traces,
          const analysis::AnalysisOptions& options, ProgressBar& bar, Pages& pages) {
  viewer_export::HtmlReport page;
  viewer_export::PerfettoExport perfetto({});
  Both both(page, perfetto);
  const auto result = analyze_with_progress(traces, options, bar, &both);
  std::ostringstream report;
  page.write(report, result, options.spec);
  pages.report = std::move(report).str();
  SpoolBuffer buffer(pages.timeline);
  std::ostream timeline(&buffer);
  timeline.exceptions(std::ios::badbit | std::ios::failbit);
  perfetto.write(timeline, result);
  timeline.flush();
}

}  // namespace

int view_command(const Arguments& arguments) {
  std::vector<std::filesystem::path> traces;
  std::string spec_file;
  std::string port_text = std::to_string(kPerfettoPort);
  CommandLine line({"cie view TRACE... [OPTIONS]", kDescription, kFooter});
  line.traces(traces);
  line.option("--spec", "FILE", spec_file,
              "Scheduling spec (YAML) that names chains and deadlines");
  line.option("--port", "NUMBER", port_text,
              "Port on 127.0.0.1 (default: 9001, the one Perfetto may use)");
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  require_traces(traces);
  int port = port_of(port_text);
  const auto spec = load_spec(spec_file);

  // Signals are waited for below; threads started from here on leave them alone.
  sigset_t signals{};
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM, SIGHUP})
    sigaddset(&signals, number);

  Pages pages;
  httplib::Server server;
  server.set_socket_options(use_port_alone);
  set_up(server, pages, port);
  // Before the work: a port that is taken is said at once.
  const int bound = port == 0                          ? server.bind_to_any_port(kHost)
                    : server.bind_to_port(kHost, port) ? port
                                                       : -1;
  if (bound < 0) {
    fmt::print(stderr, "cie: port {} of {} is taken: end what uses it, or choose another --port\n",
               port, kHost);
    return unreadable;
  }
  port = bound;
  ProgressBar bar(reader.is_progress_wanted());
  make(traces,
       {.spec = spec ? &*spec : nullptr,
        .reader = reader.value(),
        .metadata_from = reader.metadata()},
       bar, pages);

  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::thread serving([&server] { server.listen_after_bind(); });
  while (!server.is_running())  // it cannot be stopped before
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  fmt::print("The report:   http://{}:{}/\n", kHost, port);
  if (port == kPerfettoPort) {
    fmt::print("The timeline: {}/#!/?url=http://{}:{}/trace.pftrace\n", kViewer, kHost, port);
  }
  fmt::print("Ctrl-C ends.\n");
  std::fflush(stdout);
  int received = 0;
  sigwait(&signals, &received);
  server.stop();
  serving.join();
  return ok;
}

}  // namespace cie::cli
