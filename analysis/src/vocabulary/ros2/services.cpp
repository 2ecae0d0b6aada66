#include "services.hpp"

#include "announcements.hpp"

#include <algorithm>

namespace cie::analysis::ros2 {
namespace {

constexpr std::size_t kMaxServed = 4096;
constexpr std::size_t kMaxServers = 64;  // of one call, whose responses are remembered

// Distributions differ in how many zeros follow.
std::string gid_of(const Payload& p, std::size_t slot) {
  std::string gid;
  for (const auto byte : p.integers(slot))
    gid += static_cast<char>(byte);
  gid.erase(gid.find_last_not_of('\0') + 1);
  return gid;
}

}  // namespace

void Services::apply(Ros2Event event, const Telling& telling, const Payload& p, Context& context) {
  switch (event) {
    case Ros2Event::client_identity: {
      const auto gid = gid_of(p, 1);
      if (gid.empty()) break;
      auto& known = clients_[gid];
      if (known == 0) known = new_gid();
      context.process.clients[p.number<Address>(0)] = known;
      break;
    }
    case Ros2Event::client_init:
      enter_client(telling, p, context.process);
      break;
    case Ros2Event::service_init:
      enter_service(telling, p, context.process);
      break;
    case Ros2Event::send_request:
      send_request(p, context);
      break;
    case Ros2Event::take_request:
      context.thread.requested.reset();
      if (const auto call = call_of(p, 1, 2); call && p.number<int>(3, 1) != 0) {
        context.thread.requested = Request{.service = p.number<Address>(0), .call = *call};
      }
      break;
    case Ros2Event::send_response:
      send_response(p, context);
      break;
    case Ros2Event::take_response:
      take_response(p, context);
      break;
    default:
      break;
  }
}

void Services::enter_client(const Telling& telling, const Payload& p, Process& process) {
  const auto handle = p.number<Address>(3);
  const auto client = process.clients.find(handle);
  if (client == process.clients.end()) return;
  process.directory.add_caller(handle, p.number<Address>(1), std::string(p.text(2)) + " (request)",
                               client->second, telling);
}

void Services::enter_service(const Telling& telling, const Payload& p, Process& process) {
  const auto handle = p.number<Address>(3);
  if (handle == 0) return;
  const bool is_its = process.directory.add_caller(
      handle, p.number<Address>(1), std::string(p.text(2)) + " (response)", new_gid(), telling);
  if (is_its) process.services[handle] = p.text(2);
}

std::optional<CallKey> Services::call_of(const Payload& p, std::size_t gid,
                                         std::size_t number) const {
  const auto client = clients_.find(gid_of(p, gid));
  if (client == clients_.end()) return std::nullopt;
  return CallKey{client->second, p.number<std::int64_t>(number)};
}

// No event tells a request's source timestamp, and layers differ in whether they tell of it before
// or after they write it. It was not written before what its thread did last.
void Services::send_request(const Payload& p, Context& context) {
  auto* client = context.process.directory.caller(p.number<Address>(0));
  if (client == nullptr) return;
  announce(*client, context.head, context.process, context.sink);
  const CallKey call{client->gid, p.number<std::int64_t>(1)};
  MessageLinks::Origin origin{.gid = client->gid, .stamp = 0};
  if (const auto* taken = requests_.find(call)) {
    origin = *taken;
  } else if (context.before > client->last_stamp) {
    origin.stamp = client->last_stamp = context.before;
  } else {
    origin.stamp = new_name();
  }
  requests_[call] = origin;
  emit(context.head,
       Publish{.publisher = client->id,
               .seq = client->next_seq++,
               .source_timestamp_realtime_ns = origin.stamp},
       context.sink);
}

MessageLinks::Origin Services::requested(const Callback& callback, Context& context) {
  auto& requested = context.thread.requested;
  if (!requested) return {};
  const auto service = context.process.services.find(requested->service);
  const bool is_its = service == context.process.services.end()
                          ? callback.source.empty()
                          : service->second == callback.source;
  if (!is_its) {
    requested.reset();
    return {};
  }
  if (const auto* told = requests_.find(requested->call)) return *told;
  // It is told after it was taken.
  return requests_[requested->call] = {.gid = requested->call.first, .stamp = new_name()};
}

void Services::note_instance(const RunningCallback& instance, Context context) {
  auto& requested = context.thread.requested;
  if (!requested) return;
  auto& served = context.process.served;
  if (served.size() >= kMaxServed) served.clear();
  served.insert_or_assign(*requested, instance);
}

void Services::send_response(const Payload& p, Context& context) {
  const auto call = call_of(p, 1, 2);
  if (!call) return;
  const Request request{.service = p.number<Address>(0), .call = *call};
  note_response(
      {.origin = respond(request, p, context), .source_timestamp = p.number<std::int64_t>(3)},
      responses_[*call]);
}

// That instance has most often ended then.
MessageLinks::Origin Services::respond(const Request& request, const Payload& p, Context& context) {
  auto& process = context.process;
  auto* service = process.directory.caller(request.service);
  const auto instance = process.served.find(request);
  if (service == nullptr || instance == process.served.end()) return {};
  announce(*service, context.head, process, context.sink);
  service->last_stamp = std::max(p.number<std::int64_t>(3, context.realtime),
                                 detail::wrapping_add(service->last_stamp, 1));
  emit(context.head,
       Publish{.publisher = service->id,
               .seq = service->next_seq++,
               .source_timestamp_realtime_ns = service->last_stamp,
               .callback = instance->second.callback->id,
               .callback_seq = instance->second.seq},
       context.sink);
  process.served.erase(instance);
  return {.gid = service->gid, .stamp = service->last_stamp};
}

void Services::note_response(const Response& response, Responses& responses) {
  const auto of_same = std::ranges::find_if(responses, [&response](const Response& other) {
    return other.origin.gid == response.origin.gid;
  });
  if (of_same == responses.end()) {
    // Of so many servers nobody needs to know all.
    if (responses.size() < kMaxServers) responses.push_back(response);
  } else {
    *of_same = response;
  }
}

const Services::Response* Services::taken_of(const Responses& responses,
                                             std::int64_t source_timestamp) {
  const auto may_be_it = [source_timestamp](const Response& response) {
    return source_timestamp == 0 || response.source_timestamp == 0 ||
           response.source_timestamp == source_timestamp;
  };
  const auto one = std::ranges::find_if(responses, may_be_it);
  return std::ranges::count_if(responses, may_be_it) == 1 ? &*one : nullptr;
}

void Services::take_response(const Payload& p, Context& context) {
  auto& process = context.process;
  if (p.number<int>(1, 1) == 0) return;
  if (const auto hidden = process.directory.hidden_of(p.number<Address>(0))) {
    emit(context.head, UntracedInstance{.hidden = *hidden}, context.sink);
  }
  const auto client = process.clients.find(p.number<Address>(0));
  if (client == process.clients.end()) return;
  const auto* responses = responses_.find({client->second, p.number<std::int64_t>(2)});
  if (responses == nullptr) return;
  const auto* response = taken_of(*responses, p.number<std::int64_t>(3));
  if (response == nullptr || response->origin.gid == 0) return;
  emit(context.head,
       ResponseTaken{.writer_gid = response->origin.gid,
                     .source_timestamp_realtime_ns = response->origin.stamp},
       context.sink);
}

}  // namespace cie::analysis::ros2
