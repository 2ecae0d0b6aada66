// The participant behind a Context, and the threads of Cyclone DDS that came with it.
#pragma once

#include <cie/executor/context.hpp>
#include <cie/scheduling/background_server.hpp>
#include <cie/scheduling/served_node.hpp>
#include <cie/tracepoints/trace.hpp>

#include "dds_entity.hpp"
#include "graph.hpp"
#include "scheduling_names.hpp"
#include "warnings.hpp"

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cie::executor {

class ContextState {
 public:
  explicit ContextState(const Context::Options& options);
  ContextState(const ContextState&) = delete;
  ContextState& operator=(const ContextState&) = delete;
  ~ContextState();

  const Context::Options& options() const noexcept { return options_; }
  dds_entity_t participant() const noexcept { return participant_.get(); }
  Graph& graph() noexcept { return *graph_; }
  // May outlive this, in what DDS still calls.
  const std::shared_ptr<Warnings>& warnings() const noexcept { return warnings_; }
  std::vector<AnnouncedThread> workers() const;
  // Answers the parameter services of all nodes. Started by the first call. Thread-safe. Throws
  // std::system_error.
  BackgroundServer& parameter_server();

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
  std::shared_ptr<Warnings> warnings_;
  DomainClaim claim_;
  dds::Entity domain_;  // only with a configuration of our own
  dds::Entity participant_;
  std::optional<Graph> graph_;
  mutable std::mutex mutex_;  // of what follows
  std::vector<AnnouncedThread> workers_;
  std::unique_ptr<BackgroundServer> parameter_server_;
};

}  // namespace cie::executor
