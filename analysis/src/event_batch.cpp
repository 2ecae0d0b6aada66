#include "event_batch.hpp"

#include "reader/field.hpp"

#include <cassert>
#include <cstdint>
#include <cstring>
#include <new>
#include <string_view>
#include <type_traits>

namespace cie::analysis {
namespace {

// Makes views of an event point to copies. Every kind of event that has views is named here.
class Keeper {
 public:
  explicit Keeper(std::pmr::memory_resource& memory) : memory_(memory) {}

  void keep(StreamBegin& event) { keep(event.host, event.clock_uuid, event.path); }
  void keep(DamagedPacket& event) { keep(event.reason); }
  void keep(RunBegin& event) {
    keep(event.tool_version, event.executor, event.boot_id, event.host, event.spec_sha256);
  }
  void keep(NodeInit& event) { keep(event.name); }
  void keep(CallbackInit& event) { keep(event.logical_id, event.source, event.symbol); }
  void keep(PublisherInit& event) { keep(event.topic); }
  void keep(ThreadInit& event) { keep(event.name); }
  void keep(ThreadSched& event) { keep(event.cpus); }
  void keep(SchedSwitch& event) { keep(event.prev_comm, event.next_comm); }
  void keep(SchedProcessFork& event) { keep(event.child_comm); }
  void keep(ProcessName& event) { keep(event.name); }
  void keep(OtherEvent& event) { keep(event.name); }
  void keep(Untranslated& event) {
    const Payload payload(event.fields);
    auto* const slots =
        static_cast<Field*>(memory_.allocate(kMaxSlots * sizeof(Field), alignof(Field)));
    for (std::size_t i = 0; i < kMaxSlots; ++i) {
      auto& field = *new (slots + i) Field(payload.collected(i));
      if (field.kind == Field::Kind::text) {
        field.characters = static_cast<const char*>(copy(field.characters, field.length, 1));
      } else if (field.kind == Field::Kind::integers) {
        field.elements = static_cast<const std::uint32_t*>(
            copy(field.elements, field.length * sizeof(std::uint32_t), alignof(std::uint32_t)));
      }
    }
    event.fields = {.slots = slots, .begin = nullptr, .fixed = nullptr};
  }
  template <typename Body>
  requires(sizeof(Body) <= sizeof(CallbackStart)) void keep(Body& /*event*/) {}

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
  const void* copy(const void* from, std::size_t size, std::size_t alignment) {
    if (size == 0) return nullptr;
    auto* to = memory_.allocate(size, alignment);
    std::memcpy(to, from, size);
    return to;
  }

  std::pmr::memory_resource& memory_;
};

}  // namespace

EventBatch::EventBatch(std::size_t capacity) : events_(capacity) {}

void EventBatch::add(const Event& event) {
  assert(!is_full() && "the caller asks first");
  auto& kept = events_[size_++];
  kept.head = event.head;
  std::visit(
      [this, &kept](const auto& body) {
        using Body = std::remove_cvref_t<decltype(body)>;
        Keeper(memory_).keep(kept.body.emplace<Body>(body));
      },
      event.body);
}

void EventBatch::clear() noexcept {
  size_ = 0;
  memory_.release();
}

}  // namespace cie::analysis
