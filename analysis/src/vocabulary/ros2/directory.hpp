// Who is who in one process of ROS 2: nodes, publishers, groups, and the callbacks behind
// addresses. Addresses are given anew by the system, so each holds what was said of it last; what
// it meant before lives on under its id.
#pragma once

#include <cie/analysis/event.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace cie::analysis::ros2 {

using Address = std::uint64_t;

struct Node {
  NodeId id{};
  std::string name{};  // fully qualified
  bool is_told = false;
};

struct Publisher {
  PublisherId id{};
  std::optional<NodeId> node{};
  std::string topic{};  // empty: never announced
  std::uint64_t gid = 0;
  std::uint64_t next_seq = 0;
  std::int64_t last_stamp = 0;
  bool is_told = false;
};

// A callback whose runs no event shows: of a client, or of an action.
struct Hidden {
  std::string what{};  // "the client of /car/enable"
  std::optional<NodeId> node{};
  std::optional<Address> group{};
  bool is_client = false;
  bool is_action = false;
};

// One callback, however many addresses it has. What every run looks at comes first.
struct Callback {
  CallbackId id{};
  std::optional<CallbackKind> kind{};  // empty: made before the recording began
  bool is_told = false;
  bool is_taking_told = false;  // it was given what `rmw_take` told of, so far as anything
  bool is_queue_told = false;   // likewise what a buffer did
  std::uint32_t number = 0;     // among those of its logical id; 0: not told yet
  std::uint64_t next_seq = 0;
  std::uint64_t told_after = 0;  // losses: see Directory::lose()
  Address rmw_subscription = 0;  // rmw's handle; 0: it has none, or that is not told
  std::optional<NodeId> node{};
  std::string source{};
  std::string symbol{};
  std::optional<std::uint64_t> period_ns{};
  std::optional<Timestamp> first_expiry{};
  std::uint32_t queue_depth = 0;
  std::optional<Address> group{};
  bool is_identified = false;  // what its logical id is made of was told, as far as tracers do
  std::uint64_t releases = 0;
  std::uint64_t overwritten = 0;
};

// What rcl_subscription_init says.
struct SubscriptionInit {
  Address handle = 0;
  Address node = 0;
  std::string_view topic;
  std::uint32_t queue_depth = 0;
  Address rmw_handle = 0;  // 0: not told
};

class Directory {
 public:
  // What the events of the same names say. `repeats`: by a tracer that may say it a second time.
  void add_node(Address handle, std::string_view name, std::string_view name_space);
  void add_publisher(Address handle, Address node, std::string_view topic, std::uint64_t gid,
                     bool repeats);
  void add_subscription(const SubscriptionInit& init, bool repeats);
  void add_service(Address handle, Address node, std::string_view service, bool repeats);
  void add_client(Address handle, Address node, std::string_view service, Address rmw_handle,
                  bool repeats);
  // What sends requests or responses, by rmw's handle; `topic`: what they are called.
  void add_caller(Address rmw_handle, Address node, std::string_view topic, std::uint64_t gid,
                  bool repeats);
  // `made`: when; empty: that is not told.
  void add_timer(Address handle, std::uint64_t period_ns, std::optional<Timestamp> made,
                 bool repeats);
  void link_timer(Address handle, Address node);
  void add_object(Address subscription_handle, Address object);
  void add_object_callback(Address object, Address callback, bool repeats);
  void add_handle_callback(CallbackKind kind, Address handle, Address callback, bool repeats);
  void add_symbol(Address callback, std::string_view symbol);
  void add_group(Address group, std::string_view type);
  void join_group(Address group, Address handle);
  // `address` stands for the callback of `handle` from now on.
  void stand_for(CallbackKind kind, Address address, Address handle);
  // Events were lost, or may have been: whatever addresses meant, something else may lie there by now,
  // until they are told of again.
  void lose() noexcept { ++losses_; }
  // What lies at the callback's addresses, or runs there.
  bool may_be_another(const Callback& callback) const noexcept {
    return callback.told_after != losses_;
  }
  // Nothing is known of the address any more.
  void forget_address(Address address) {
    forget(address);
    bindings_.erase(address);
  }
  void link_buffer(Address buffer, Address object) {
    objects_of_buffers_[buffer] = {.object = object, .told_after = losses_};
  }
  void link_object(Address object, Address subscription) {
    subscriptions_of_objects_[object] = subscription;
  }

  // Whether anything was said of them yet.
  bool has_callback(Address address) const { return bindings_.contains(address); }
  bool has_publisher(Address handle) const { return publishers_.contains(handle); }

  // The callback behind an address; an unknown one the first time that nobody spoke of it. Callbacks
  // stay where they are.
  Callback& callback(Address address) {
    auto& asked = asked_[place(address)];
    if (asked.address != address || address == 0) asked = {address, &find_callback(address)};
    return *asked.callback;
  }
  // The callback that a queue between callbacks feeds. Null: unknown.
  Callback* callback_of_buffer(Address buffer) const;
  // It may feed another one than that by now.
  bool may_feed_another(Address buffer, const Callback& callback) const;
  std::deque<Callback>& callbacks() noexcept { return callbacks_; }  // in the order of their making
  // Of the client of that rmw handle. Empty: unknown.
  std::optional<std::uint32_t> hidden_of(Address rmw_client) const;
  const Hidden& hidden(std::uint32_t number) const { return hidden_[number]; }
  // Those of which something new was said since the last call.
  std::vector<std::uint32_t> news_of_hidden() { return std::exchange(news_of_hidden_, {}); }
  std::size_t hidden_callbacks() const noexcept { return hidden_.size(); }
  // A publisher of that handle; one without a topic if it was never announced.
  Publisher& publisher(Address handle);
  Publisher* caller(Address rmw_handle);  // null: unknown
  Node* node(NodeId id);
  std::optional<GroupType> group_type(Address group) const;
  // The id of a group that was announced.
  std::optional<GroupId> group(Address address) const;

  // `<node>@Subscription(<topic>)`, with #2, #3, … for those of the same name made later.
  // Asked for once, when the callback is told.
  std::string logical_id(Callback& callback) const;

 private:
  // What a handle stands for: how its callback will be described.
  struct Entity {
    CallbackKind kind = CallbackKind::timer;
    std::optional<NodeId> node{};
    std::string source{};
    std::optional<std::uint64_t> period_ns{};
    std::optional<Timestamp> first_expiry{};
    std::uint32_t queue_depth = 0;
    Address rmw_subscription = 0;
    std::optional<Address> group{};
    bool is_announced = false;
    bool is_node_unknown = false;   // it has one that was never announced
    std::uint64_t told_after = 0;   // losses
    std::uint64_t bound_after = 0;  // likewise, to an address of its callback
    Callback* callback = nullptr;
    std::optional<std::uint32_t> hidden{};
  };
  struct Object {
    Address handle = 0;
    bool has_callback = false;
  };
  // An address of a callback. The object or handle may be announced later than its callback.
  struct Binding {
    std::optional<Address> object{};
    Callback* callback = nullptr;
    std::string symbol{};
    Address handle = 0;            // of the callback; 0: not known yet
    std::uint64_t told_after = 0;  // losses
  };
  struct Buffer {
    Address object = 0;            // that it belongs to
    std::uint64_t told_after = 0;  // losses
  };
  struct Group {
    GroupId id{};
    std::optional<GroupType> type{};
  };

  // What an address stood for when it was asked for last: every start asks.
  struct Asked {
    Address address = 0;  // 0: nothing
    Callback* callback = nullptr;
  };
  static constexpr std::size_t kAsked = 64;  // a power of two

  // Addresses of one process lie 16 bytes apart or more.
  static std::size_t place(Address address) noexcept { return address / 16 % kAsked; }
  // Before it stands for something else.
  void forget(Address address) noexcept { asked_[place(address)] = {}; }
  Callback& find_callback(Address address);
  // What ran there before anything was said of the address: a tracer that repeats tells of it now.
  // Null: nothing did.
  Callback* unnamed(Address address) const;
  Entity& renew(Address handle, CallbackKind kind, std::string_view source, bool repeats);
  void bind(Address address, Binding& binding, Address handle);
  // It is told again.
  void confirm(Binding& binding);
  void hide(Entity& entity, Hidden hidden);
  void describe(Callback& callback, const Entity& entity) const;
  void refresh(const Entity& entity);
  Callback& new_callback();
  std::optional<NodeId> node_of(Address handle) const;
  void set_node(Entity& entity, Address node) const;
  std::string_view node_name(const Callback& callback) const;  // "?": unknown
  std::string plain_id(const Callback& callback) const;

  std::array<Asked, kAsked> asked_{};
  std::vector<Node> nodes_;
  std::deque<Callback> callbacks_;
  std::unordered_map<Address, NodeId> nodes_by_handle_;
  std::unordered_map<Address, Publisher> publishers_;
  std::uint32_t publishers_made_ = 0;
  std::unordered_map<Address, Publisher> callers_;
  std::uint32_t callers_made_ = 0;
  std::unordered_map<Address, Entity> entities_;  // by rcl handle
  std::deque<Hidden> hidden_;
  std::vector<std::uint32_t> news_of_hidden_;
  std::unordered_map<Address, std::uint32_t> clients_;  // hidden ones, by rmw handle
  std::unordered_map<Address, Object> objects_;         // of rclcpp's subscriptions
  std::unordered_map<Address, Binding> bindings_;
  std::unordered_map<Address, std::vector<Address>> waiting_;  // callbacks, by object
  std::unordered_map<Address, Group> groups_;
  std::unordered_map<Address, Buffer> objects_of_buffers_;
  std::unordered_map<Address, Address> subscriptions_of_objects_;
  std::uint64_t losses_ = 0;
  bool links_timers_ = false;  // the tracer tells whose timers are
  bool names_late_ = false;    // callbacks ran before they were named
};

}  // namespace cie::analysis::ros2
