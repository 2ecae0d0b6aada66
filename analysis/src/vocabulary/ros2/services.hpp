// Requests and responses of services: who sent which, and which instance answered it. Tracers tell
// them since tracetools 8.5; a client's gid and its sequence number name a call.
#pragma once

#include "message_links.hpp"
#include "process_state.hpp"
#include "ros2_event.hpp"
#include "vocabulary/field.hpp"

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>

namespace cie::analysis::ros2 {

class Services {
 public:
  // Ignores events of which no service's call follows.
  void apply(Ros2Event event, const Telling& telling, const Payload& p, Context& context);
  // What the service's instance that begins now has taken.
  MessageLinks::Origin requested(const Callback& callback, Context& context);
  // It is that instance: its response will be told.
  void note_instance(const RunningCallback& instance, Context context);

 private:
  // The last few calls, by what names them.
  class Calls {
   public:
    const MessageLinks::Origin* find(const CallKey& call) const;
    void add(const CallKey& call, const MessageLinks::Origin& origin);

   private:
    static constexpr std::size_t kMaxCalls = 4096;
    std::map<CallKey, MessageLinks::Origin> by_key_;
    std::deque<CallKey> in_order_;
  };

  void enter_client(const Telling& telling, const Payload& p, Process& process);
  void enter_service(const Telling& telling, const Payload& p, Process& process);
  std::optional<CallKey> call_of(const Payload& p, std::size_t gid, std::size_t number) const;
  void send_request(const Payload& p, Context& context);
  void send_response(const Payload& p, Context& context);
  void take_response(const Payload& p, Context& context);
  std::uint64_t new_gid() noexcept { return kFirstGid + ++made_; }
  // A stamp that tells no time.
  std::int64_t new_name() noexcept { return -++names_; }

  static constexpr std::uint64_t kFirstGid = 0x726f'7332'8000'0000U;  // beyond those of publishers

  std::unordered_map<std::string, std::uint64_t> clients_;  // model's gids by DDS's
  Calls requests_;
  Calls responses_;
  std::uint64_t made_ = 0;
  std::int64_t names_ = 0;
};

}  // namespace cie::analysis::ros2
