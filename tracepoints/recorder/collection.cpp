#include "collection.hpp"

#include <cie/tracepoints/utf8.hpp>

#include "base/text.hpp"
#include "ctf/stream_check.hpp"
#include "system/directory_claim.hpp"
#include "system/error.hpp"

#include <array>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
constexpr std::chrono::milliseconds kSignalWait{200};
// Less than packets need. A relay daemon that cannot write one says so to nobody.
constexpr std::uintmax_t kNoSpace = std::uintmax_t{1} << 20U;

std::set<fs::path> folders_of_hosts(const fs::path& directory) {
  std::set<fs::path> found;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    std::error_code ignored;
    if (entry.is_directory(ignored)) found.insert(entry.path());
  }
  return found;
}

// For the terminal: HOST and SESSION are what another machine calls itself.
std::string shown(const fs::path& session, const fs::path& directory) {
  return printable(session.lexically_relative(directory).string());
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
  std::string text = fmt::format("{} packets", packets);
  if (discarded > 0) text += fmt::format(", LOST: {} events discarded at their host", discarded);
  if (lost > 0) text += fmt::format(", LOST: {} packets", lost);
  if (damaged > 0) text += fmt::format(", {} streams end within a packet", damaged);
  return text;
}

// "on each machine: cie record --to desk:5342 ...", where others reach this address.
std::string how_to_send(NetworkAddress address) {
  if (address.host == "localhost" || address.host == "::1" || address.host.starts_with("127.")) {
    return fmt::format(
        "on this machine alone: cie record --to {} ...\n"
        "(for others: cie collect --listen with an address of this machine that they reach)",
        address.text());
  }
  if (address.host == "0.0.0.0" || address.host == "::") {
    std::array<char, HOST_NAME_MAX + 1> name{};
    if (gethostname(name.data(), name.size() - 1) == 0) address.host = name.data();
  }
  return fmt::format("on each machine: cie record --to {} ...", address.text());
}

}  // namespace

Collection::Collection(const CollectOptions& options) : options_(options) {
  const Directory directory = make_own(options.directory);
  if (faccessat(directory.get(), ".", W_OK | X_OK, 0) != 0)
    throw system_error("cannot write to " + in_quotes(options.directory), errno);
  before_ = sessions();
  relay_ = std::make_unique<RelayDaemon>(options.listen, options.directory);
}

// HOST/SESSION-DATE.
std::set<fs::path> Collection::sessions() const {
  std::set<fs::path> found;
  for (const fs::path& host : folders_of_hosts(options_.directory)) {
    found.merge(folders_of_hosts(host));
  }
  return found;
}

void Collection::tell_of_new_sessions() {
  for (const fs::path& session : sessions()) {
    if (before_.contains(session) || !known_.insert(session).second) continue;
    std::fprintf(stderr, "receiving %s\n", shown(session, options_.directory).c_str());
  }
}

void Collection::look_at_space() {
  if (had_no_space_) return;
  std::error_code error;
  const auto space = fs::space(options_.directory, error);
  const auto left = geteuid() == 0 ? space.free : space.available;
  if (error || left >= kNoSpace) return;
  had_no_space_ = true;
  std::fprintf(stderr, "warning: %s\n", no_space().c_str());
}

std::string Collection::no_space() const {
  return "no space is left for " + in_quotes(options_.directory) +
         ": what machines send may be lost; free some, or collect in another directory (-o)";
}

void Collection::run() {
  std::fprintf(stderr,
               "collecting in %s; %s\n"
               "watch: cie live %s\n",
               options_.directory.c_str(), how_to_send(relay_->control()).c_str(),
               relay_->live_url().c_str());
  while (relay_->is_alive()) {
    const auto signal = signals_.wait(kSignalWait);
    tell_of_new_sessions();
    look_at_space();
    if (signal && signal->number != SIGCHLD && signal->number != SIGUSR1) {
      relay_->stop();
      look_at_space();
      print_summary();
      if (had_no_space_) throw RecordError(no_space());
      return;
    }
  }
  throw RecordError("the relay daemon of LTTng ended: " + relay_->how_it_ended() + "; " +
                    (had_no_space_ ? no_space()
                                   : "cie collect -o " + in_quotes(options_.directory) +
                                         ", started again, receives what follows"));
}

void Collection::print_summary() const {
  for (const fs::path& session : known_) {
    std::fprintf(stderr, "%s: %s\n", shown(session, options_.directory).c_str(),
                 summary_of(session).c_str());
  }
  if (known_.empty()) {
    std::fputs("nothing was received\n", stderr);
  } else if (!had_no_space_) {
    std::fprintf(stderr, "next: cie report %s\n", options_.directory.c_str());
  }
}

}  // namespace cie::record
