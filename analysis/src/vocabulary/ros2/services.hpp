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
#include <vector>

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
  // What belongs to the last few calls, by what names them.
  template <typename Of>
  class Calls {
   public:
    const Of* find(const CallKey& call) const {
      const auto found = by_key_.find(call);
      return found == by_key_.end() ? nullptr : &found->second;
    }
    Of& operator[](const CallKey& call) {
      const auto [of, is_new] = by_key_.try_emplace(call);
      if (!is_new) return of->second;
      in_order_.push_back(call);
      if (in_order_.size() > kMaxCalls) {
        by_key_.erase(in_order_.front());
        in_order_.pop_front();
      }
      return of->second;
    }

   private:
    static constexpr std::size_t kMaxCalls = 4096;
    std::map<CallKey, Of> by_key_;
    std::deque<CallKey> in_order_;
  };
  // Each server that offers the service answers a call.
  struct Response {
    MessageLinks::Origin origin{};      // of no writer: whose instance sent it is not known
    std::int64_t source_timestamp = 0;  // 0: not told
  };
  using Responses = std::vector<Response>;  // to one call

  static void note_response(const Response& response, Responses& responses);
  // Null: it cannot be told which one it is.
  static const Response* taken_of(const Responses& responses, std::int64_t source_timestamp);
  void enter_client(const Telling& telling, const Payload& p, Process& process);
  void enter_service(const Telling& telling, const Payload& p, Process& process);
  std::optional<CallKey> call_of(const Payload& p, std::size_t gid, std::size_t number) const;
  void send_request(const Payload& p, Context& context);
  void send_response(const Payload& p, Context& context);
  // By the instance that took the request, if it is known. What the response is called in the
  // model.
  static MessageLinks::Origin respond(const Request& request, const Payload& p, Context& context);
  void take_response(const Payload& p, Context& context);
  std::uint64_t new_gid() noexcept { return kFirstGid + ++made_; }
  // A stamp that tells no time.
  std::int64_t new_name() noexcept { return -++names_; }

  static constexpr std::uint64_t kFirstGid = 0x726f'7332'8000'0000U;  // beyond those of publishers

  std::unordered_map<std::string, std::uint64_t> clients_;  // model's gids by DDS's
  Calls<MessageLinks::Origin> requests_;
  Calls<Responses> responses_;
  std::uint64_t made_ = 0;
  std::int64_t names_ = 0;
};

}  // namespace cie::analysis::ros2
