#include "event_batch.hpp"

#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

namespace cie::analysis {
namespace {

// Large for the copies of names that they hold.
constexpr std::uint64_t kWithNames = kinds<SchedSwitch, SchedProcessFork>();

// Makes views point to copies: one function for each kind of kWithViews.
class Keeper {
 public:
  explicit Keeper(std::pmr::memory_resource& memory) : memory_(memory) {}

  void keep(StreamBegin& event) { keep(event.host, event.clock_uuid, event.path, event.malformed); }
  void keep(PacketBegin& event) { keep(event.file); }
  void keep(DamagedPacket& event) { keep(event.reason); }
  void keep(RunBegin& event) {
    keep(event.tool_version, event.executor, event.boot_id, event.host, event.spec_sha256);
  }
  void keep(NodeInit& event) { keep(event.name); }
  void keep(CallbackInit& event) { keep(event.logical_id, event.source, event.symbol); }
  void keep(PublisherInit& event) { keep(event.topic); }
  void keep(ThreadInit& event) { keep(event.name); }
  void keep(ThreadSched& event) { keep(event.cpus); }
  void keep(ForeignCallback& event) { keep(event.logical_id); }
  void keep(Ros2Tracer& event) { keep(event.version); }
  void keep(UntracedEntity& event) { keep(event.what, event.node); }
  void keep(UntracedWriter& event) { keep(event.topic); }
  void keep(ProcessName& event) { keep(event.name); }
  void keep(OtherEvent& event) {
    keep(event.name);
    if (event.fields.empty()) return;
    const std::span fields(
        static_cast<FieldValue*>(
            copy(event.fields.data(), event.fields.size_bytes(), alignof(FieldValue))),
        event.fields.size());
    for (auto& field : fields) {
      if (field.kind == FieldValue::Kind::text) keep(field.text);
    }
    event.fields = fields;
  }

 private:
  void keep(std::string_view& text) {
    text = {static_cast<const char*>(copy(text.data(), text.size(), 1)), text.size()};
  }
  void keep(std::span<const std::uint32_t>& numbers) {
    const auto* kept = copy(numbers.data(), numbers.size_bytes(), alignof(std::uint32_t));
    numbers = {static_cast<const std::uint32_t*>(kept), numbers.size()};
  }
  template <typename... Views>
  requires(sizeof...(Views) > 1) void keep(Views&... views) { (keep(views), ...); }
  void* copy(const void* from, std::size_t size, std::size_t alignment) {
    if (size == 0) return nullptr;
    auto* to = memory_.allocate(size, alignment);
    std::memcpy(to, from, size);
    return to;
  }

  std::pmr::memory_resource& memory_;
};

}  // namespace

EventBatch::EventBatch(std::size_t capacity)
    : events_(std::make_unique<Event[]>(capacity)),  // NOLINT(modernize-avoid-c-arrays)
      next_(events_.get()),
      new_(next_),
      capacity_(capacity),
      end_(events_.get() + capacity) {}

void EventBatch::keep_shown(const OtherEvent& event) noexcept {
  shown_ += event.fields.size_bytes();
  for (const auto& field : event.fields)
    shown_ += field.text.size();
  if (shown_ > kMostShown) end_ = next_;
}

void EventBatch::keep_views(EventBody& body) {
  std::visit(
      [this](auto& event) {
        using Body = std::remove_cvref_t<decltype(event)>;
        if constexpr ((kWithViews & kinds<Body>()) != 0) {
          Keeper(memory_).keep(event);
          if constexpr (std::is_same_v<Body, OtherEvent>) keep_shown(event);
        } else {
          static_assert(sizeof(Body) <= sizeof(CallbackStart) || (kWithNames & kinds<Body>()) != 0,
                        "large enough to hide views");
        }
      },
      body);
}

void EventBatch::clear() noexcept {
  next_ = new_ = events_.get();
  end_ = next_ + capacity_;
  shown_ = 0;
  kinds_ = 0;
  derived_.clear();
  memory_.release();
}

}  // namespace cie::analysis
