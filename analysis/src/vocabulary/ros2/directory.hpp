// Who is who in one process of ROS 2: nodes, publishers, groups, and the callbacks behind
// addresses. Addresses are given anew by the system, so each holds what was said of it last, or what was
// made last where a tracer says when; what it meant before lives on under its id.
#pragma once

#include <cie/analysis/event.hpp>

#include "made_by_name.hpp"
#include "message_topic.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace cie::analysis::ros2 {

using Address = std::uint64_t;

// When what an address means was made. Empty: that is not told.
using Made = std::optional<Timestamp>;

// How an event tells of something.
struct Telling {
  bool repeats = false;  // by a tracer that may say it a second time, and in any order
  Timestamp told{};
  Made made{};
};

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
  MessageTopic* messages = nullptr;        // of its topic, once it was seen to publish
  std::optional<std::uint32_t> told_in{};  // the channel of its latest publication
  Address awaited_node = 0;                // its node's handle, if that is told later
  Made made{};
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

struct Namesakes;

// One callback, however many addresses it has. What every run looks at comes first.
struct Callback {
  CallbackId id{};
  std::optional<CallbackKind> kind{};  // empty: made before the recording began
  bool is_told = false;
  bool is_taking_told = false;  // it was given what `rmw_take` told of, so far as anything
  bool is_queue_told = false;   // likewise what a buffer did
  std::uint32_t number = 0;     // among those of its logical id; 0: not told yet
  std::uint64_t next_seq = 0;
  std::uint64_t told_after = 0;  // losses: see Directory::lose(); or Directory::kShared
  Address rmw_subscription = 0;  // rmw's handle; 0: it has none, or that is not told
  std::optional<NodeId> node{};
  std::string source{};
  std::string symbol{};
  std::optional<std::uint64_t> period_ns{};
  std::optional<Timestamp> first_expiry{};
  Duration expiry_spread{};
  std::uint32_t queue_depth = 0;
  std::optional<Address> group{};
  Address handle = 0;  // rcl's; 0: not known
  Made made{};
  Address node_handle = 0;         // which a tracer that repeats may tell of later
  Made node_made{};                // when it was linked to that
  Timestamp unnamed_since{};       // if it ran before anything was said of its address
  bool is_identified = false;      // what its logical id is made of was told, as far as tracers do
  bool is_after_rcl_init = false;  // made, or seen to run first, since Directory::begin_again()
  bool is_described_anew = false;  // since its namesakes were looked for
  Namesakes* namesakes = nullptr;  // with it; null: not looked for yet
  Callback* former = nullptr;      // which had an address of it before, if that is taken since then
  std::uint64_t releases = 0;
  std::uint64_t overwritten = 0;
  std::string id_beside_own{};  // once asked for, where this project's events do not tell of it
};

// Callbacks with one logical id but for their numbers.
struct Namesakes {
  std::string_view plain_id{};             // that
  std::vector<Callback*> callbacks{};      // in the order of their making
  std::multiset<std::uint32_t> numbers{};  // that were told
};

// What rcl_publisher_init says.
struct AnnouncedPublisher {
  Address handle = 0;
  Address node = 0;
  std::string_view topic;
  Address rmw_handle = 0;  // 0: not told
};

// What rcl_subscription_init says.
struct SubscriptionInit {
  Address handle = 0;
  Address node = 0;
  std::string_view topic;
  std::uint32_t queue_depth = 0;
  Address rmw_handle = 0;  // 0: not told
};

struct TimerMade {
  Timestamp at;
  Duration spread;  // it may have been earlier by up to that
};

class Directory {
 public:
  // What the events of the same names say.
  void add_node(Address handle, std::string_view name, std::string_view name_space,
                const Telling& telling);
  void add_publisher(const AnnouncedPublisher& init, std::uint64_t gid, const Telling& telling);
  void add_subscription(const SubscriptionInit& init, const Telling& telling);
  void add_service(Address handle, Address node, std::string_view service, const Telling& telling);
  void add_client(Address handle, Address node, std::string_view service, Address rmw_handle,
                  const Telling& telling);
  // What sends requests or responses, by rmw's handle; `topic`: what they are called. False: another one
  // has that handle since.
  bool add_caller(Address rmw_handle, Address node, std::string_view topic, std::uint64_t gid,
                  const Telling& telling);
  // `made`: when; empty: that is not told.
  void add_timer(Address handle, std::uint64_t period_ns, std::optional<TimerMade> made,
                 const Telling& telling);
  void link_timer(Address handle, Address node, const Telling& telling);
  void add_object(Address subscription_handle, Address object, const Telling& telling);
  void add_object_callback(Address object, Address callback, const Telling& telling);
  void add_handle_callback(CallbackKind kind, Address handle, Address callback,
                           const Telling& telling);
  void add_symbol(Address callback, std::string_view symbol, const Telling& telling);
  void add_group(Address group, std::string_view type, const Telling& telling);
  void join_group(Address group, Address handle, const Telling& telling);
  void add_executor(Address executor, std::string_view type);
  // The executor runs what is in the group; 0: which one is not told.
  void serve_group(Address group, Address executor);
  // `address` stands for the callback of `handle` from now on.
  void stand_for(CallbackKind kind, Address address, Address handle);
  // Events were lost, or may have been: whatever addresses meant, something else may lie there by now,
  // until they are told of again.
  void lose() noexcept { ++losses_; }
  // The process began with the recording: all that it makes is told.
  void see_whole() noexcept { is_seen_whole_ = true; }
  bool is_seen_whole() const noexcept { return is_seen_whole_; }
  // rcl_init of a pid that has told before: of another context, or of another process.
  void begin_again() noexcept { is_begun_again_ = true; }
  // It, or the one before it at an address, was bound there since: both may live, in two processes.
  static bool shares_address(const Callback& callback) noexcept {
    return callback.told_after == kShared;
  }
  // What lies at the callback's addresses, or runs there.
  bool may_be_another(const Callback& callback) const noexcept {
    return callback.told_after != losses_;
  }
  // Nothing is known of the address any more.
  void forget_address(Address address) {
    forget(address);
    bindings_.erase(address);
  }
  void link_buffer(Address buffer, Address object, const Telling& telling) {
    link(objects_of_buffers_[buffer], object, telling);
  }
  void link_object(Address object, Address subscription, const Telling& telling) {
    link(subscriptions_of_objects_[object], subscription, telling);
  }

  // Whether anything was said of them yet.
  bool has_callback(Address address) const { return bindings_.contains(address); }
  bool has_publisher(Address handle) const { return publishers_.contains(handle); }

  // The callback behind an address; an unknown one the first time that nobody spoke of it. Callbacks
  // stay where they are.
  Callback& callback(Address address, Timestamp now) {
    auto& asked = asked_[place(address)];
    if (asked.address != address || address == 0) asked = {address, &find_callback(address, now)};
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
  // The handle of what publishes by that rmw handle. Empty: unknown.
  std::optional<Address> publisher_of(Address rmw_handle) const;
  Publisher* caller(Address rmw_handle);  // null: unknown
  Node* node(NodeId id);
  std::optional<GroupType> group_type(Address group) const;
  // Its executor is told to have several threads.
  bool is_pooled(Address group) const;
  // The id of a group that was announced.
  std::optional<GroupId> group(Address address) const;

  // Of a callback that will be told: nodes may have been told of since it was described.
  void find_node(Callback& callback) const;
  // `<node>@Subscription(<topic>)`, with #2, #3, … for those of the same name made later.
  // Asked for once, when the callback is told.
  std::string logical_id(Callback& callback);

 private:
  // What a handle stands for: how its callback will be described.
  struct Entity {
    std::optional<CallbackKind> kind{};  // empty: not told yet
    std::optional<NodeId> node{};
    std::string source{};
    std::optional<std::uint64_t> period_ns{};
    std::optional<Timestamp> first_expiry{};
    Duration expiry_spread{};
    std::uint32_t queue_depth = 0;
    Address rmw_subscription = 0;
    std::optional<Address> group{};
    Made made{};
    Made node_made{};          // when it was linked to that
    Address node_handle = 0;   // which a tracer that repeats may tell of later
    Address awaited_node = 0;  // its node's handle, if that is told later
    Made group_made{};         // when it joined that
    Made told_before{};        // when something of it was told, if that was before its announcement
    bool is_announced = false;
    bool may_repeat = false;        // by a tracer that may say it a second time
    bool is_node_unknown = false;   // it has one that was never announced
    std::uint64_t told_after = 0;   // losses
    std::uint64_t bound_after = 0;  // likewise, to an address of its callback
    Callback* callback = nullptr;
    std::vector<Address> addresses{};  // of that, but for those of single calls
    std::optional<std::uint32_t> hidden{};
  };
  struct Object {
    Address handle = 0;
    Made made{};
    bool has_callback = false;
    std::vector<Address> addresses{};  // of its callback, where a tracer that repeats told of it
  };
  // An address of a callback. The object or handle may be announced later than its callback.
  struct Binding {
    std::optional<Address> object{};
    Callback* callback = nullptr;
    Callback* ran = nullptr;     // there, before anything was said of the address
    Callback* last = nullptr;    // whose it was last
    Callback* former = nullptr;  // whose it was before, if it is taken over since begin_again()
    std::string symbol{};
    Made symbol_made{};
    bool is_symbol_of_next = false;  // it was told after the one of what lies there
    Address handle = 0;              // of the callback; 0: not known yet
    Made made{};
    std::uint64_t told_after = 0;  // losses
  };
  struct NodeOfHandle {
    Made made{};
    NodeId node{};
  };
  struct Link {
    Address to = 0;
    Made made{};
    std::uint64_t told_after = 0;  // losses
  };
  // What refers to a node that was not told yet.
  struct Awaiting {
    std::vector<Address> entities{};
    std::vector<Publisher*> publishers{};
  };
  struct HiddenClient {
    std::uint32_t number = 0;
    Made made{};
  };
  struct Group {
    GroupId id{};
    std::optional<GroupType> type{};
    Made type_made{};
    Address executor = 0;  // 0: not told
  };

  static constexpr auto kShared = std::numeric_limits<std::uint64_t>::max();
  // Far from what an executor of this project numbers from 0, should a process have both.
  static constexpr std::uint32_t kFirstId = 1'000'000;
  template <typename Id>
  static Id id_of(std::size_t number) noexcept {
    return static_cast<Id>(kFirstId + static_cast<std::uint32_t>(number));
  }
  // What an address stood for when it was asked for last: every start asks.
  struct Asked {
    Address address = 0;  // 0: nothing
    Callback* callback = nullptr;
  };
  static constexpr std::size_t kAsked = 256;  // a power of two

  // Addresses of one process lie 16 bytes apart or more.
  static std::size_t place(Address address) noexcept { return address / 16 % kAsked; }
  // Before it stands for something else.
  void forget(Address address) noexcept { asked_[place(address)] = {}; }
  Callback& find_callback(Address address, Timestamp now);
  // Of two that have an address one after the other the one made later holds it, whichever is told first.
  static bool is_former(const Telling& telling, const Made& known) noexcept {
    return telling.repeats && telling.made && known && *telling.made < *known;
  }
  // It may have been told before: whatever was made when that was.
  static bool is_repeated(const Telling& telling, const Made& known) noexcept {
    return telling.repeats && (!telling.made || !known || *telling.made == *known);
  }
  static bool is_of_former(const Telling& telling, const Entity& entity) noexcept {
    return entity.is_announced && is_former(telling, entity.made);
  }
  // Whether what ran there nameless is what a tracer that repeats tells of now.
  static bool has_run(const Callback* callback, const Telling& telling) noexcept;
  // Nobody was told of it, nor is anything said of it.
  static bool is_nameless(const Callback* callback) noexcept {
    return callback != nullptr && !callback->kind && !callback->is_told;
  }
  // What was not told yet will be.
  bool is_told_whole() const noexcept { return is_seen_whole_ && losses_ == 0; }
  // It ran, or was told.
  static bool is_seen(const Callback& callback) noexcept {
    return callback.is_told || callback.next_seq != 0;
  }
  // Whether `known` becomes another one.
  static bool is_renewed(Publisher& known, std::string_view topic, const Telling& telling);
  void link(Link& known, Address to, const Telling& telling) const {
    if (!is_former(telling, known.made))
      known = {.to = to, .made = telling.made, .told_after = losses_};
  }
  // Null: another one has the handle since.
  Entity* renew(Address handle, const Entity& described, const Telling& telling);
  void note_told_before(Entity& entity);
  // `is_first`: nothing is known to have had the handle before.
  void leave_former(Address handle, Entity& entity, const Telling& telling, bool is_first);
  void count_former(Address handle, const Entity& former);
  void link_former(Address handle, Address node, const Telling& telling);
  // The handle gets a callback, and had another one.
  void leave_callback(CallbackKind kind, Address handle, Entity& entity, const Telling& telling);
  // The address will be one of another callback.
  Binding& take_over(Address address, const Telling& telling);
  void release(Address address, Binding& binding);
  // Its handle has it no more; that handle. 0: none had it.
  Address let_go(Address address, Binding& binding);
  // Until it is let go.
  void hold(Address address, Binding& binding, Address handle);
  // By the object that its callback belongs to.
  void hold_by(Object& object, Address address, Binding& binding, const Telling& telling);
  void bind(Address address, Binding& binding, Address handle);
  static void share(Callback& callback, Callback& former) noexcept;
  // It is told again.
  void confirm(Binding& binding);
  void hide(Entity& entity, Hidden hidden);
  void describe(Callback& callback, const Entity& entity) const;
  void refresh(const Entity& entity);
  void describe_anew(Callback& callback, const Entity& entity);
  // It is the callback that was looked for under another name.
  void drop(Callback& callback) {
    callback.kind.reset();
    look_again(callback);
  }
  Callback& new_callback();
  // Of something made then.
  std::optional<NodeId> node_of(Address handle, const Made& made) const;
  void set_node(Address handle, Entity& entity, Address node, const Telling& telling);
  void set_node(Publisher& publisher, Address node);
  // What referred to the node gets it.
  void end_awaiting(Address node);
  std::string_view node_name(const Callback& callback) const;  // "?": unknown
  std::string plain_id(const Callback& callback) const;
  // It may have other namesakes by now.
  void look_again(Callback& callback);
  // Of those called like it it is one from now on.
  void join_namesakes(Callback& callback);
  static void leave_namesakes(Callback& callback);
  void find_namesakes();
  // What the handle stands for has changed, or is about to.
  void touch(Address handle, const Entity& entity) {
    if (entity.may_repeat) entities_anew_.insert(handle);
  }
  void count_anew();
  std::uint32_t count_without_callback(const Callback& callback);
  // Its topic, service or period was told.
  static bool is_described(const Callback& callback) noexcept;

  std::uint64_t losses_ = 0;
  bool is_seen_whole_ = false;
  bool is_begun_again_ = false;
  bool links_timers_ = false;  // the tracer tells whose timers are
  bool links_late_ = false;    // it may tell later which nodes callbacks are of
  bool has_new_nodes_ = false;
  bool has_renamed_ = false;  // likewise, since count_anew()
  bool names_late_ = false;   // callbacks ran before they were named, or are told in any order
  std::array<Asked, kAsked> asked_{};
  std::vector<Node> nodes_;
  std::deque<Callback> callbacks_;
  std::unordered_map<std::string, Namesakes> namesakes_;  // by plain_id()
  std::vector<Callback*> described_anew_;
  // What a handle stood for that was made then.
  using HandleAndMade = std::pair<Address, Timestamp>;
  std::map<HandleAndMade, Callback> formers_;  // gone when a tracer that repeats told of them
  // Those of them and of entities_ that have no callback, and of which something was told since they
  // were counted.
  MadeByName<HandleAndMade> formers_by_name_;
  MadeByName<Address> entities_by_name_;
  std::set<HandleAndMade> formers_anew_;
  std::unordered_set<Address> entities_anew_;
  // Callbacks that were ever described so.
  std::map<HandleAndMade, std::vector<const Callback*>> callbacks_by_handle_;
  std::unordered_map<Address, std::vector<NodeOfHandle>> nodes_by_handle_;  // as they were made
  std::unordered_map<Address, Awaiting> awaiting_nodes_;
  std::unordered_map<Address, Publisher> publishers_;
  std::uint32_t publishers_made_ = 0;
  std::unordered_map<Address, Address> publishers_of_rmw_;  // by rmw's handle
  std::unordered_map<Address, Publisher> callers_;
  std::uint32_t callers_made_ = 0;
  std::unordered_map<Address, Entity> entities_;  // by rcl handle
  std::deque<Hidden> hidden_;
  std::vector<std::uint32_t> news_of_hidden_;
  std::unordered_map<Address, HiddenClient> clients_;  // by rmw handle
  std::unordered_map<Address, Object> objects_;        // of rclcpp's subscriptions
  std::unordered_map<Address, Binding> bindings_;
  std::unordered_map<Address, std::vector<Address>> waiting_;  // callbacks, by object
  std::unordered_map<Address, Group> groups_;
  std::unordered_set<Address> pools_;  // executors of several threads
  std::unordered_map<Address, Link> objects_of_buffers_;
  std::unordered_map<Address, Link> subscriptions_of_objects_;
};

}  // namespace cie::analysis::ros2
