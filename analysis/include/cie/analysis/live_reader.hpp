// Reads a running LTTng session from its relay daemon, through libbabeltrace2's src.ctf.lttng-live.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cie::analysis {

// A live session that a relay daemon offers.
struct LiveSession {
  std::string url;  // for LiveReader: net://RELAY[:PORT]/host/HOST/SESSION
  std::string host;
  std::string name;
  std::uint64_t streams = 0;
  std::uint64_t clients = 0;  // a session serves one reader at a time
};

// What the relay daemon at net://HOST[:PORT] offers. Throws UnreadableTrace if it does not answer.
std::vector<LiveSession> live_sessions(const std::string& relay);

// What all readers of one analyzer share: of several sessions, or of one that is read again after
// its connection was lost. Not thread-safe.
class LiveInput {
 public:
  // `analyzer` is borrowed.
  explicit LiveInput(Analyzer& analyzer);
  ~LiveInput();
  LiveInput(const LiveInput&) = delete;
  LiveInput& operator=(const LiveInput&) = delete;

  // Before the analyzer's: feeds it what follows from all that was read.
  void finish();

 private:
  friend class LiveReader;
  struct Shared;
  std::unique_ptr<Shared> shared_;
};

// Feeds an Analyzer with what a session writes from now on; what was written before is not sent.
// libbabeltrace2 may abort on input that is damaged, and waits without limit for a relay daemon
// that is silent: whoever must survive that reads in a process of its own. Not thread-safe.
class LiveReader {
 public:
  enum class Step : std::uint8_t {
    events,   // some were fed; there may be more at once
    nothing,  // none now: try again a little later
    end       // the session ended, or the relay daemon said good-bye
  };

  // `input` is borrowed. Throws UnreadableTrace.
  LiveReader(const std::string& url, LiveInput& input);
  ~LiveReader();
  LiveReader(const LiveReader&) = delete;
  LiveReader& operator=(const LiveReader&) = delete;

  // Throws UnreadableTrace when the session does not exist or the connection is lost.
  Step step();
  // The connection is lost for good: the analyzer is told that what has not ended does so with what
  // came last, so that what another reader brings is known to come after a gap.
  void give_up();
  // Numbers of the traces that it has read, as those of ProcessReport.
  std::vector<std::uint32_t> traces() const;

 private:
  struct Graph;
  std::unique_ptr<Graph> graph_;
};

}  // namespace cie::analysis
