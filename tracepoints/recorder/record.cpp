#include "record.hpp"

#include "keeping/chunks_keeping.hpp"
#include "keeping/directory_keeping.hpp"
#include "keeping/live_keeping.hpp"
#include "keeping/outcome.hpp"
#include "keeping/relay_keeping.hpp"
#include "keeping/snapshots_keeping.hpp"
#include "system/console.hpp"
#include "target/target.hpp"

#include <exception>
#include <memory>
#include <optional>

#include <fmt/format.h>

namespace cie::record {
namespace {

std::unique_ptr<Keeping> make_keeping(const Options& options, Console& console) {
  if (options.snapshot) return std::make_unique<SnapshotsKeeping>(options, console);
  if (options.rotate) return std::make_unique<ChunksKeeping>(options, console);
  if (options.relay) return std::make_unique<RelayKeeping>(options, console);
  return std::make_unique<DirectoryKeeping>(options, console);
}

// False if nobody wants what would be recorded.
bool start(Target& target, Keeping& keeping) {
  try {
    if (!keeping.begin()) return false;
    target.start();
    keeping.start_reading();
    return true;
  } catch (...) {
    keeping.abandon();
    throw;
  }
}

// Empty: nobody wanted it.
std::optional<Outcome> run(Target& target, Keeping& keeping) {
  if (!start(target, keeping)) return std::nullopt;
  while (const auto event = target.next()) {
    if (*event == Target::Event::request) keeping.on_request(target);
    keeping.poll(target);
  }
  return keeping.finish(target.exit());
}

}  // namespace

int record(const Options& options) {
  Console console;
  Target target(options);
  const std::unique_ptr<Keeping> keeping = make_keeping(options, console);
  const Outcome outcome = run(target, *keeping).value();
  console.say(summary(outcome));
  return exit_status(outcome);
}

bool stream_live(const Options& options) {
  Target target(options);
  LiveKeeping keeping(options);
  try {
    run(target, keeping);
    return true;
  } catch (const std::exception& error) {
    keeping.tell(fmt::format("failed {}", error.what()));
    return false;
  }
}

}  // namespace cie::record
