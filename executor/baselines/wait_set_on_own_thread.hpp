// All callbacks on the thread that spins, served from a DDS wait set.
#pragma once

#include <cie/scheduling/own_thread.hpp>

#include "scheduling_names.hpp"

namespace cie::executor {

class WaitSetOnOwnThread final : public OwnThread {
 public:
  // Throws dds::Error.
  explicit WaitSetOnOwnThread(const LoopParts& parts);

  void run(std::int64_t deadline_ns, Cancellation& cancellation) override;
  void cancel() noexcept override {}
};

}  // namespace cie::executor
