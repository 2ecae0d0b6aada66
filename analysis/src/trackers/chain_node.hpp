// Instances as links of chains, and who keeps them alive.
#pragma once

#include "model/facts.hpp"
#include "model/optional_time.hpp"

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <new>
#include <utility>

namespace cie::analysis {

struct ChainNode;
class ChainNodePool;

// Shares a node with whoever may still descend from it. Counts without atomic operations, unlike a
// shared_ptr in a program with threads: an analyzer and its nodes belong to one thread.
class ChainNodeRef {
 public:
  ChainNodeRef() = default;
  explicit ChainNodeRef(ChainNode& node) noexcept;
  ChainNodeRef(const ChainNodeRef& other) noexcept;
  ChainNodeRef(ChainNodeRef&& other) noexcept : node_(std::exchange(other.node_, nullptr)) {}
  ChainNodeRef& operator=(ChainNodeRef other) noexcept {
    std::swap(node_, other.node_);
    return *this;
  }
  ~ChainNodeRef() { reset(); }

  void reset() noexcept;
  ChainNode* get() const noexcept { return node_; }
  ChainNode& operator*() const noexcept { return *node_; }
  ChainNode* operator->() const noexcept { return node_; }
  explicit operator bool() const noexcept { return node_ != nullptr; }

 private:
  friend class ChainNodePool;
  ChainNode* node_ = nullptr;
};

// One instance as a link of chains.
struct alignas(64) ChainNode {
  enum class Link : std::uint8_t { source, resolved, outside, before, unseen, forgotten };
  // What is known of its end. Awaited: numbers will tell whether it was lost. Untold: it was not told
  // yet, and need not be: if an exception left it, what its thread published since is not its own.
  // Lost: as was the start of a later instance of its thread; what it is taken to have published may
  // be that one's.
  enum class End : std::uint8_t { settled, awaited, untold, lost };

  CallbackIndex callback{};
  HostIndex host{};
  std::uint64_t seq = 0;
  EventRef start;
  OptionalTime release;      // exact ones only
  OptionalTime earliest;     // it was not released before
  std::uint64_t read = 0;    // its read's number among those of its callback in the window
  bool is_in_window = true;  // began inside the window
  End end = End::settled;

  // outside: published outside any callback; before: before the first that was seen; forgotten: its
  // parent, as what lies further back than chains are long. Of `before` and `unseen` the publication
  // may yet be read: where the clock of its host is ahead.
  Link link = Link::source;
  std::uint32_t depth = 0;  // instances before it; lags where one of them was resolved after it
  // The message it took: writer and source timestamp; parent and published are resolved from them.
  std::uint64_t writer_gid = 0;
  std::int64_t source_timestamp = 0;
  ChainNodeRef parent;
  Timestamp published;  // when the parent published it, by its host's clock
  OptionalTime sent;    // the same by this host's clock; unknown: they cannot be related
  HostIndex writer_host{};

  // It took a message, but nobody knows of which instance.
  bool is_cut() const noexcept {
    return link == Link::unseen || (parent && parent->end == End::lost);
  }

 private:
  friend class ChainNodeRef;
  friend class ChainNodePool;
  std::uint32_t references_ = 0;
  ChainNodePool* pool_ = nullptr;
};
static_assert(sizeof(ChainNode) == 128, "as many are kept as publishers have messages");

// Owns nodes and gives those out again that nobody refers to. Outlives all references but those of
// nodes to each other, which it leaves as they are.
class ChainNodePool {
 public:
  ChainNodePool() = default;
  ChainNodePool(const ChainNodePool&) = delete;
  ChainNodePool& operator=(const ChainNodePool&) = delete;

  // A node as new.
  ChainNodeRef take();
  // Copies of the node and of those before it, `count` in all if there are so many. They alone
  // forget what lies further back: others that descend from the same instances do not.
  ChainNodeRef copy_of_last(const ChainNode& node, std::uint32_t count);
  // How many somebody refers to.
  std::size_t in_use() const noexcept { return in_use_; }

 private:
  friend class ChainNodeRef;
  // Nobody refers to the node any more.
  static void give_back(ChainNode* node) noexcept;
  // In blocks that grow, so that the report fits where they were.
  static constexpr std::size_t kFirstBlock = 2048;
  std::pmr::monotonic_buffer_resource memory_{kFirstBlock * sizeof(ChainNode)};
  ChainNode* free_ = nullptr;  // the next one is its parent
  std::size_t in_use_ = 0;
};

inline ChainNodeRef::ChainNodeRef(ChainNode& node) noexcept : node_(&node) { ++node.references_; }

inline ChainNodeRef::ChainNodeRef(const ChainNodeRef& other) noexcept : node_(other.node_) {
  if (node_ != nullptr) ++node_->references_;
}

[[gnu::always_inline]] inline void ChainNodeRef::reset() noexcept {
  auto* node = std::exchange(node_, nullptr);
  if (node != nullptr && --node->references_ == 0) ChainNodePool::give_back(node);
}

// Nor, perhaps, to those before it: not by recursion, so that to drop one of several references takes
// few instructions.
[[gnu::noinline]] inline void ChainNodePool::give_back(ChainNode* node) noexcept {
  auto& pool = *node->pool_;
  do {
    auto* const parent = std::exchange(node->parent.node_, pool.free_);
    pool.free_ = node;
    --pool.in_use_;
    node = parent;
  } while (node != nullptr && --node->references_ == 0);
}

inline ChainNodeRef ChainNodePool::take() {
  void* place = free_;
  if (free_ != nullptr) {
    free_ = free_->parent.node_;
  } else {
    place = memory_.allocate(sizeof(ChainNode), alignof(ChainNode));
  }
  ++in_use_;
  auto* node = ::new (place) ChainNode;
  node->pool_ = this;
  return ChainNodeRef(*node);
}

inline ChainNodeRef ChainNodePool::copy_of_last(const ChainNode& node, std::uint32_t count) {
  const auto copy_of = [this](const ChainNode& from) {
    auto to = take();
    *to = from;
    to->references_ = 1;
    // Nobody tells a copy.
    if (to->end != ChainNode::End::lost) to->end = ChainNode::End::settled;
    return to;
  };
  auto last = copy_of(node);
  last->depth = count - 1;
  auto* copy = last.get();
  for (const auto* from = node.parent.get(); from != nullptr; from = from->parent.get()) {
    if (copy->depth == 0) {
      copy->parent.reset();
      copy->link = ChainNode::Link::forgotten;
      break;
    }
    copy->parent = copy_of(*from);
    copy->parent->depth = copy->depth - 1;
    copy = copy->parent.get();
  }
  return last;
}

}  // namespace cie::analysis
