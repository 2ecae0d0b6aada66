#include <cie/executor/cancel_on_signals.hpp>
#include <cie/executor/executor.hpp>
#include <cie/scheduling/executor_core.hpp>

#include "calls_in_progress.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <mutex>
#include <system_error>
#include <utility>

namespace cie {
namespace {

using scheduling::ExecutorCore;

constexpr std::array<int, 2> kSignals{SIGINT, SIGTERM};

// What the handler reads: a list that only grows. A slot without an executor is free.
struct Slot {
  std::atomic<ExecutorCore*> core{nullptr};
  Slot* next = nullptr;
};
std::atomic<Slot*> slots{nullptr};
std::atomic<bool> is_received{false};
executor::CallsInProgress handling;  // handlers that may use an executor
static_assert(std::atomic<ExecutorCore*>::is_always_lock_free &&
              std::atomic<bool>::is_always_lock_free);

std::mutex mutex;  // of what follows, and of taking a slot
int installed = 0;
std::array<struct sigaction, kSignals.size()> former{};

void on_signal(int) {
  const int error = errno;
  handling.enter();
  is_received = true;
  for (Slot* slot = slots.load(); slot != nullptr; slot = slot->next) {
    if (ExecutorCore* const core = slot->core.load()) core->cancel();
  }
  handling.leave();
  errno = error;
}

void put_back(std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i)
    sigaction(kSignals[i], &former[i], nullptr);
}

void install() {
  const std::lock_guard lock{mutex};
  if (installed++ > 0) return;
  is_received = false;
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    if (sigaction(kSignals[i], &action, &former[i]) == 0) continue;
    const int error = errno;
    put_back(i);
    --installed;
    throw std::system_error{error, std::generic_category(), "cannot catch SIGINT and SIGTERM"};
  }
}

void uninstall() noexcept {
  const std::lock_guard lock{mutex};
  if (--installed == 0) put_back(kSignals.size());
}

Slot& take_slot(ExecutorCore& core) {
  const std::lock_guard lock{mutex};
  for (Slot* slot = slots.load(); slot != nullptr; slot = slot->next) {
    if (slot->core.load() != nullptr) continue;
    slot->core = &core;
    return *slot;
  }
  auto fresh = std::make_unique<Slot>();
  fresh->core = &core;
  fresh->next = slots.load();
  slots = fresh.get();
  return *fresh.release();
}

}  // namespace

// The core outlives its executor here, so that the handler always finds one.
struct CancelOnSignals::Entry {
  Slot* slot;
  std::shared_ptr<ExecutorCore> core;
};

CancelOnSignals::CancelOnSignals() { install(); }

CancelOnSignals::CancelOnSignals(Executor& executor) : CancelOnSignals() { add(executor); }

CancelOnSignals::~CancelOnSignals() {
  for (const Entry& entry : entries_)
    entry.slot->core = nullptr;
  handling.wait_for_none();
  entries_.clear();  // the end of an executor that is gone already: a signal must not cut it short
  uninstall();
}

void CancelOnSignals::add(Executor& executor) {
  entries_.reserve(entries_.size() + 1);
  entries_.push_back({&take_slot(*executor.core()), executor.core()});
  if (is_requested()) executor.cancel();
}

bool CancelOnSignals::is_requested() const noexcept { return is_received.load(); }

}  // namespace cie
