// The serving side of a service as a callback.
#pragma once

#include <cie/executor/service.hpp>
#include <cie/scheduling/clock.hpp>

#include "reader_callback.hpp"
#include "services/service_ends.hpp"

#include <cstdint>
#include <memory>
#include <utility>

namespace cie::executor {

// Its instances answer requests. Between them responses leave that waited for their clients.
class ServiceCallback final : public ReaderCallback {
 public:
  ServiceCallback(std::shared_ptr<GroupState> group, trace::CallbackInfo info, ServerEnd end)
      : ReaderCallback(std::move(group), std::move(info), std::move(end.requests)),
        replier_(std::move(end.replier)) {}
  ~ServiceCallback() override { end(); }

  std::int64_t next_due() const noexcept override { return kNever; }

 private:
  bool run_one() override;
  void dispose() noexcept override;

  std::unique_ptr<Replier> replier_;
};

}  // namespace cie::executor
