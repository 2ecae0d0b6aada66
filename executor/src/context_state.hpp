// The participant behind a Context, and the threads of Cyclone DDS that came with it.
#pragma once

#include <cie/executor/context.hpp>
#include <cie/tracepoints/trace.hpp>

#include "dds_entity.hpp"
#include "graph.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cie::executor {

// A thread that DDS made. Its receive thread is part of every chain of callbacks between processes.
struct WorkerThread {
  std::string name;
  std::unique_ptr<trace::Thread> trace;
};

class ContextState {
 public:
  explicit ContextState(const Context::Options& options);
  ContextState(const ContextState&) = delete;
  ContextState& operator=(const ContextState&) = delete;
  ~ContextState();

  const Context::Options& options() const noexcept { return options_; }
  dds_entity_t participant() const noexcept { return participant_.get(); }
  Graph& graph() noexcept { return *graph_; }
  const std::vector<WorkerThread>& workers() const noexcept { return workers_; }

 private:
  // Claims a domain for one Context of the process.
  class DomainClaim {
   public:
    explicit DomainClaim(std::uint32_t domain);
    DomainClaim(const DomainClaim&) = delete;
    DomainClaim& operator=(const DomainClaim&) = delete;
    ~DomainClaim();

   private:
    std::uint32_t domain_;
  };

  Context::Options options_;
  DomainClaim claim_;
  dds::Entity domain_;  // only with a configuration of our own
  dds::Entity participant_;
  std::optional<Graph> graph_;
  std::vector<WorkerThread> workers_;
};

}  // namespace cie::executor
