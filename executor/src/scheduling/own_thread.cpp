#include <cie/scheduling/own_thread.hpp>

namespace cie::scheduling {

Placement::Teams OwnThread::place(const Callbacks& callbacks) {
  if (!spinning_) spinning_ = id_of_current_thread();
  for (const auto& callback : callbacks) {
    callback->move_to(*spinning_);
    loop_->add(callback);
  }
  return {};
}

Placement::Vacating OwnThread::take_off(const Callbacks& callbacks) {
  return [this, callbacks](Running running) {
    if (running == Running::awaited) {
      loop_->remove(callbacks);
    } else {
      loop_->abandon(callbacks);
    }
    return Teams{};
  };
}

Placement::Waiting OwnThread::stop() {
  return
      [this, callbacks = Callbacks(served().begin(), served().end())] { loop_->remove(callbacks); };
}

}  // namespace cie::scheduling
