#include <cie/analysis/live_reader.hpp>

#include "base/messages.hpp"
#include "batch_text.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "companion.hpp"
#include "exit_code.hpp"
#include "failure.hpp"
#include "feed.hpp"
#include "flight_saver.hpp"
#include "history.hpp"
#include "inputs.hpp"
#include "live_options.hpp"
#include "live_views.hpp"
#include "save_trigger.hpp"
#include "snapshot_json.hpp"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

namespace cie::cli {
namespace {

using live::Companion;
using live::Feed;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kLongestWait{200};
// The process that reads says every second that it is alive (feed.cpp).
constexpr std::chrono::seconds kReaderSilence{3};
// How long a command may take to end, and its last events to come.
constexpr std::chrono::seconds kEndPatience{60};
// How long the recorder takes at most to notice that a daemon of LTTng ended.
constexpr std::chrono::seconds kNoticePatience{3};

// What `name` stands for: the URL of a session, or of a relay daemon with all of its, or a
// session's name at the one here.
std::string url_of(const std::string& name) {
  const bool is_url = name.rfind("net://", 0) == 0 || name.rfind("net4://", 0) == 0;
  if (is_url && name.find("/host/") != std::string::npos) return name;
  if (!is_url && name.find('/') != std::string::npos) {
    throw UsageError("\"" + name +
                     "\" is neither a session's name nor its net:// URL; a recording is "
                     "read by cie report");
  }
  auto relay = is_url ? name : std::string("net://localhost");
  const auto sessions = analysis::live_sessions(relay);
  std::string known;
  std::vector<const analysis::LiveSession*> chosen;
  for (const auto& session : sessions) {
    if (session.name == name) chosen.push_back(&session);
    known += (known.empty() ? "" : ", ") + session.url;
  }
  if (sessions.empty()) {
    throw analysis::UnreadableTrace("the relay daemon at " + relay + " has no live session");
  }
  if (is_url) return relay;
  if (chosen.size() == 1) return chosen.front()->url;
  throw UsageError((chosen.empty() ? "there is no live session \"" + name + "\" at " + relay
                                   : "which session at " + relay + '?') +
                   "; there are: " + known);
}

// Signals as something to poll for. Blocked from here on, in threads as well.
class SignalDescriptor {
 public:
  SignalDescriptor() {
    sigset_t set{};
    sigemptyset(&set);
    for (const int number : {SIGINT, SIGTERM, SIGHUP})
      sigaddset(&set, number);
    pthread_sigmask(SIG_BLOCK, &set, nullptr);
    descriptor_ = ::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  }
  ~SignalDescriptor() { ::close(descriptor_); }
  SignalDescriptor(const SignalDescriptor&) = delete;
  SignalDescriptor& operator=(const SignalDescriptor&) = delete;

  int get() const noexcept { return descriptor_; }
  std::optional<signalfd_siginfo> take() const {
    signalfd_siginfo info{};
    if (::read(descriptor_, &info, sizeof info) != sizeof info) return std::nullopt;
    return info;
  }

 private:
  int descriptor_ = -1;
};

// One run of the command, once its options are known.
class Live {
 public:
  Live(const LiveOptions& options, const SchedulingSpec* spec)
      : options_(options), trigger_(options.save_limits) {
    if (!options.flight_directory.empty()) saver_.emplace(options.flight_directory);
    if (options.target.empty()) {
      companion_ = std::make_unique<Companion>(
          [&options](int socket) {
            start_program("cie-record", recorder_arguments(options, socket));
          },
          options.view == LiveOptions::View::screen);
      feed_options_.url = companion_->wait_for_url();
      feed_options_.is_reconnecting = false;
    } else {
      feed_options_.url = url_of(options.target);
    }
    feed_options_.watched = !options.command.empty() ? shell_words(options.command)
                            : options.target.empty() ? "what runs here"
                                                     : feed_options_.url;
    feed_options_.spec = spec;
    feed_options_.interval = options.interval;
    feed_ = std::make_unique<Feed>(feed_options_);
    if (feed_->wait_until_connected()) {
      if (companion_) companion_->start();
    } else if (!feed_->is_over() && !feed_->has_line()) {
      throw analysis::UnreadableTrace("no answer from " + feed_options_.url);
    }
    signals_.emplace();  // the children keep theirs
    views_ = std::make_unique<LiveViews>(options, history_);
  }

  int run() {
    while (!is_over()) {
      wait();
      take_signals();
      if (companion_) hear_companion();
      take_snapshots();
      look_for_silence();
      serve_flight_recorder();
      if (!views_->update()) end();
      if (is_ending_ && steady_clock::now() > end_deadline_) break;
    }
    return finish();
  }

 private:
  bool is_over() const { return (is_ending_ && !companion_) || is_done_; }

  void wait() {
    std::vector<pollfd> descriptors;
    const auto add = [&descriptors](int descriptor) {
      if (descriptor >= 0)
        descriptors.push_back({.fd = descriptor, .events = POLLIN, .revents = 0});
    };
    add(signals_->get());
    add(feed_->descriptor());
    if (companion_) {
      add(companion_->socket());
      add(companion_->output_descriptor());
    }
    add(views_->input_descriptor());
    ::poll(descriptors.data(), descriptors.size(), static_cast<int>(kLongestWait.count()));
  }

  void take_signals() {
    while (const auto signal = signals_->take()) {
      if (std::exchange(is_ending_, true)) {  // the second one: at once
        is_done_ = true;
        return;
      }
      end_deadline_ = steady_clock::now() + kEndPatience;
      // The terminal's reached the command by itself.
      if (companion_ && signal->ssi_code != SI_KERNEL) companion_->signal(SIGTERM);
      if (options_.view == LiveOptions::View::screen) is_done_ = true;
    }
  }

  void end() {
    is_ending_ = true;
    is_done_ = true;
  }

  void take_snapshots() {
    feed_->receive();
    while (const auto line = feed_->take_line()) {
      constexpr std::string_view kError = "error: ";
      if (line->rfind(kError, 0) == 0) {
        failure_ = line->substr(kError.size());
        continue;
      }
      auto snapshot = live::parse_snapshot(*line);
      if (snapshot.state == live::SourceState::ended && has_companion_failed())
        live::note_failure(snapshot, companion_->failure());
      history_.add(std::move(snapshot));
      ++snapshots_;
      if (saver_) trigger_.see(history_.latest());
      views_->show();
      if (options_.count != 0 && snapshots_ >= options_.count) end();
      if (is_done_) return;
    }
    if (feed_->is_over()) {
      const auto reason = feed_->failure();
      if (failure_.empty()) failure_ = reason;
      if (has_companion_failed()) failure_ = companion_->failure();
      const bool is_told = snapshots_ == 0 || history_.latest().state == live::SourceState::ended;
      if (!failure_.empty() && !is_told) show_again(live::SourceState::ended, failure_);
      views_->source_ended(failure_);
      if (!views_->stays_after_the_end()) is_done_ = true;
    }
  }

  // The session that it started has ended. Unless it ended that itself, it notices now.
  bool has_companion_failed() {
    if (!companion_) return false;
    const auto deadline = steady_clock::now() + kNoticePatience;
    const auto may_tell = [this] {
      return companion_->failure().empty() && companion_->command_end().empty() &&
             companion_->socket() >= 0 && !is_ending_;
    };
    for (hear_companion(); may_tell() && steady_clock::now() < deadline; hear_companion()) {
      pollfd descriptor{.fd = companion_->socket(), .events = POLLIN, .revents = 0};
      ::poll(&descriptor, 1, static_cast<int>(kLongestWait.count()));
    }
    return !companion_->failure().empty();
  }

  void hear_companion() {
    companion_->receive();
    while (const auto note = companion_->take_note())
      tell(*note);
  }

  // The process that reads waits without limit when the relay daemon hangs, or is cut off.
  void look_for_silence() {
    const auto silence = feed_->silence();
    if (silence < kReaderSilence) silence_told_ = silence_told_.zero();
    if (is_done_ || feed_->is_over() || silence < silence_told_ + kReaderSilence) return;
    silence_told_ += kReaderSilence;
    show_again(live::SourceState::lost,
               fmt::format("no answer from the relay daemon for {} s", silence_told_.count()));
  }

  // What was seen last, now that it is not followed any more.
  void show_again(live::SourceState state, const std::string& why) {
    auto last = history_.latest();
    last.state = state;
    last.source = feed_options_.url;
    last.watched = feed_options_.watched;
    last.message = why;
    last.events_per_second = 0;
    last.changes.clear();
    for (auto& callback : last.callbacks)
      callback.recent.clear();
    if (state == live::SourceState::ended) live::note_failure(last, why);
    history_.add(std::move(last));
    views_->show();
  }

  void serve_flight_recorder() {
    if (!saver_) return;
    if (const auto outcome = saver_->poll()) tell(*outcome);
    if (saver_->is_busy()) return;
    if (const auto reason = trigger_.take(steady_clock::now(), false)) saver_->ask(*reason);
  }

  // What was seen last is worth a snapshot as well.
  void end_flight_recorder() {
    if (!saver_) return;
    if (const auto outcome = saver_->wait()) tell(*outcome);
    if (const auto reason = trigger_.take(steady_clock::now(), true)) {
      saver_->ask(*reason);
      if (const auto outcome = saver_->wait()) tell(*outcome);
    }
    if (trigger_.left_out() > 0) {
      tell(fmt::format("--max-snapshots forbade it to save {} times more", trigger_.left_out()));
    }
  }

  // On standard error; of a full screen, at its end.
  void tell(const std::string& text) {
    if (options_.view == LiveOptions::View::screen) {
      untold_.push_back(text);
    } else {
      fmt::print(stderr, "cie live: {}\n", text);
    }
  }

  int finish() {
    views_.reset();
    end_flight_recorder();
    feed_.reset();
    std::string printed;
    if (companion_) {
      companion_->end();
      hear_companion();
    }
    for (const auto& text : untold_)
      fmt::print(stderr, "cie live: {}\n", text);
    if (companion_) {
      if (!companion_->losses().empty()) {
        fmt::print(stderr, "cie live: LOST events (channel, events, packets): {}\n",
                   companion_->losses());
      }
      if (!companion_->command_end().empty()) {
        fmt::print(stderr, "cie live: {}\n", companion_->command_end());
      }
      printed = companion_->output();
      if (!companion_->failure().empty()) failure_ = companion_->failure();
    }
    companion_.reset();
    if (!printed.empty()) fmt::print(stderr, "{}", printed);
    if (failure_.empty()) return ok;
    throw analysis::UnreadableTrace(failure_);
  }

  const LiveOptions& options_;
  live::FeedOptions feed_options_;
  live::History history_;
  std::unique_ptr<Companion> companion_;
  std::unique_ptr<Feed> feed_;
  std::optional<SignalDescriptor> signals_;
  std::unique_ptr<LiveViews> views_;
  std::optional<FlightSaver> saver_;  // empty: no flight recorder
  live::SaveTrigger trigger_;
  std::vector<std::string> untold_;
  std::chrono::seconds silence_told_{0};  // of the process that reads
  std::uint64_t snapshots_ = 0;
  std::string failure_;
  bool is_ending_ = false;
  bool is_done_ = false;
  steady_clock::time_point end_deadline_{};
};

}  // namespace

int live_command(const Arguments& arguments) {
  const auto options = parse_live_options(arguments);
  if (!options) return ok;
  const auto spec = load_spec(options->spec_file);
  Live live(*options, spec ? &*spec : nullptr);
  return live.run();
}

}  // namespace cie::cli
