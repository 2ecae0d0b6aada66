#include "audit_thread.hpp"

namespace cie::scheduling {

void AuditThread::run() noexcept {
  std::unique_lock lock{mutex_};
  while (!changed_.wait_for(lock, period_, [this] { return is_stopping_; })) {
    lock.unlock();
    try {
      configurator_.audit();
    } catch (...) {
      // No memory, or a handler that threw: there is nobody to tell, and the next audit comes.
    }
    lock.lock();
  }
}

}  // namespace cie::scheduling
