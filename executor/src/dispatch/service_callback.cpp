#include "service_callback.hpp"

namespace cie::executor {

void ServiceCallback::dispose() noexcept {
  ReaderCallback::dispose();
  replier_.reset();
}

bool ServiceCallback::run_one() {
  replier_->send_waiting();
  return run_next([this](const MessagePool::Loan& request, const MessageInfo& info) {
    const Instance instance{*this, release_by(info)};
    replier_->answer(request.get(), info.writer_gid);
    return true;
  });
}

std::uint32_t matched_writers(const ServiceCallback& callback) {
  return callback.reader().matched();
}

}  // namespace cie::executor
