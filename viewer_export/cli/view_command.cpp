#include <cie/viewer_export/html_report.hpp>
#include <cie/viewer_export/perfetto_export.hpp>

#include "base/text.hpp"
#include "command_line.hpp"
#include "exit_code.hpp"
#include "http_server.hpp"
#include "inputs.hpp"
#include "output/spool.hpp"

#include <array>
#include <cstdio>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>
#include <signal.h>

namespace cie::cli {
namespace {

constexpr const char* kViewDescription =
    "Shows a trace in the browser: the report as a page, and the timeline in Perfetto's viewer.\n"
    "Serves both on this machine's loopback address only, until Ctrl-C.";

constexpr const char* kViewFooter =
    R"(Examples:
  cie view recordings/latest
  cie view run1 --spec app.yaml --port 0        any free port, for the report's page only

ui.perfetto.dev may fetch from 127.0.0.1:9001 and no other port; nothing is uploaded, its
script runs in your browser. To keep files instead: cie report -f html, cie export --to perfetto.
Exit codes: 0 ended by Ctrl-C, 2 wrong usage or spec, 4 trace unreadable or port taken.
)";

constexpr const char* kHost = "127.0.0.1";
constexpr std::uint16_t kPerfettoPort =
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
  std::shared_ptr<const std::string> report;
  viewer_export::Spool timeline{{}};
};

live::HttpResponse timeline(const viewer_export::Spool& spool) {
  live::HttpResponse response{.fields = {{"Content-Type", "application/octet-stream"}},
                              .size = spool.size()};
  response.read = [&spool](std::uint64_t offset, std::span<char> part) {
    spool.read(offset, part);
  };
  return response;
}

live::HttpResponse response_to(const live::HttpRequest& request, const Pages& pages) {
  const bool is_question = request.method == "OPTIONS";
  live::HttpResponse response{.status = 404};
  if (request.path == "/" && !is_question) {
    response = live::text_response(pages.report, "text/html; charset=utf-8");
  } else if (request.path == "/trace.pftrace") {
    // A browser asks first whether a public page may reach into this machine.
    if (is_question) {
      response = {.status = 204, .fields = {{"Access-Control-Allow-Methods", "GET"}}};
    } else {
      response = timeline(pages.timeline);
    }
    response.fields.emplace_back("Access-Control-Allow-Origin", kViewer);
    response.fields.emplace_back("Access-Control-Allow-Private-Network", "true");
  }
  response.fields.emplace_back("Cache-Control", "no-store");
  return response;
}

// Throws UsageError.
std::uint16_t port_of(const std::string& text) {
  const auto port = parse_number<std::uint16_t>(text);
  if (!port) {
    throw UsageError("--port takes a number from 0 (any free one) to 65535: \"" + text + '"');
  }
  return *port;
}

void make(const std::vector<std::filesystem::path>& traces, analysis::AnalysisOptions options,
          const std::string& input, ProgressBar& bar, Pages& pages) {
  options.keep_buckets = true;
  viewer_export::HtmlReport page;
  viewer_export::PerfettoExport perfetto({});
  Both both(page, perfetto);
  const auto result = analyze_with_progress(traces, options, bar, &both);
  std::ostringstream report;
  page.write(report, result, options.spec, input);
  pages.report = std::make_shared<const std::string>(std::move(report).str());
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
  CommandLine line({"cie view TRACE... [OPTIONS]", kViewDescription, kViewFooter});
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
  const auto port = port_of(port_text);
  const auto spec = load_spec(spec_file);

  // Signals are waited for below; threads started from here on leave them alone.
  sigset_t signals{};
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM, SIGHUP})
    sigaddset(&signals, number);

  Pages pages;
  std::optional<live::HttpServer> server;
  try {  // before the work: a port that is taken is said at once
    server.emplace(kHost, port, [&pages](const live::HttpRequest& request) {
      return response_to(request, pages);
    });
  } catch (const std::runtime_error&) {
    fmt::print(stderr, "cie: port {} of {} is taken: end what uses it, or choose another --port\n",
               port, kHost);
    return unreadable;
  }
  ProgressBar bar(reader.is_progress_wanted());
  make(traces, {.spec = spec ? &*spec : nullptr, .metadata_from = reader.metadata()},
       input_arguments(traces, reader, spec_file), bar, pages);

  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  server->start();
  fmt::print("The report:   {}\n", server->url());
  if (server->port() == kPerfettoPort) {
    fmt::print("The timeline: {}/#!/?url={}trace.pftrace\n", kViewer, server->url());
  }
  fmt::print("Ctrl-C ends.\n");
  std::fflush(stdout);
  int received = 0;
  sigwait(&signals, &received);
  return ok;
}

}  // namespace cie::cli
