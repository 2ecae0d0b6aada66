#include "collection.hpp"

#include "error.hpp"
#include "stream_check.hpp"

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <sstream>
#include <utility>

#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
constexpr std::chrono::milliseconds kTick{200};

std::set<fs::path> directories_in(const fs::path& directory) {
  std::set<fs::path> found;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    std::error_code ignored;
    if (entry.is_directory(ignored)) found.insert(entry.path());
  }
  return found;
}

std::string summary_of(const fs::path& session) {
  std::uint64_t packets = 0;
  std::uint64_t discarded = 0;
  std::uint64_t lost = 0;
  std::uint64_t damaged = 0;
  for (const StreamSummary& stream : check_streams(session)) {
    packets += stream.packets;
    discarded += stream.discarded_events;
    lost += stream.lost_packets;
    damaged += stream.is_damaged ? 1 : 0;
  }
  std::ostringstream text;
  text << packets << " packets";
  if (discarded > 0) text << ", LOST: " << discarded << " events discarded at their host";
  if (lost > 0) text << ", LOST: " << lost << " packets";
  if (damaged > 0) text << ", " << damaged << " streams end within a packet";
  return text.str();
}

}  // namespace

Collection::Collection(const CollectOptions& options) : options_(options) {
  std::error_code error;
  fs::create_directories(options.directory, error);
  if (error || access(options.directory.c_str(), W_OK | X_OK) != 0) {
    throw system_error("cannot write to " + in_quotes(options.directory),
                       error ? error.value() : errno);
  }
  before_ = sessions();
  relay_ = std::make_unique<RelayDaemon>(options.listen, options.directory);
}

// HOST/SESSION-DATE.
std::set<fs::path> Collection::sessions() const {
  std::set<fs::path> found;
  for (const fs::path& host : directories_in(options_.directory)) {
    found.merge(directories_in(host));
  }
  return found;
}

void Collection::tell_of_new_sessions() {
  for (const fs::path& session : sessions()) {
    if (before_.contains(session) || !known_.insert(session).second) continue;
    std::fprintf(stderr, "receiving %s\n", session.lexically_relative(options_.directory).c_str());
  }
}

void Collection::run() {
  std::fprintf(stderr,
               "collecting in %s; on each machine: cie record --to %s ...\n"
               "watch: cie live %s\n",
               options_.directory.c_str(), relay_->control().text().c_str(),
               relay_->live_url().c_str());
  while (relay_->is_alive()) {
    const auto signal = signals_.wait(kTick);
    tell_of_new_sessions();
    if (signal && signal->number != SIGCHLD && signal->number != SIGUSR1) {
      relay_->stop();
      print_summary();
      return;
    }
  }
  throw RecordError("the relay daemon of LTTng ended: " + relay_->last_words());
}

void Collection::print_summary() const {
  for (const fs::path& session : known_) {
    std::fprintf(stderr, "%s: %s\n", session.lexically_relative(options_.directory).c_str(),
                 summary_of(session).c_str());
  }
  if (known_.empty()) {
    std::fputs("nothing was received\n", stderr);
  } else {
    std::fprintf(stderr, "next: cie report %s\n", options_.directory.c_str());
  }
}

}  // namespace cie::record
