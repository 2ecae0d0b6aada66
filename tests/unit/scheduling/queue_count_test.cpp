#include "scheduling/queue_count.hpp"

#include <deque>
#include <random>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

// A KEEP_LAST queue that knows the truth, beside the count that has to find it out.
class ModelQueue {
 public:
  explicit ModelQueue(std::uint32_t depth) : depth_(depth), count_(depth) {}
  void store() {
    if (queue_.size() == depth_) {
      queue_.pop_front();
      ++truth_;
    }
    queue_.push_back(0);
    reported_ = count_.on_stored();
  }
  bool take() {
    const auto before = count_.begin_take();
    const bool is_empty = queue_.empty();
    if (!is_empty) queue_.pop_front();
    count_.end_take(is_empty ? TakeOutcome::empty : TakeOutcome::sample, before);
    return !is_empty;
  }
  std::uint64_t truth() const { return truth_; }
  std::uint64_t reported() const { return reported_; }
  std::uint64_t counted() const { return count_.overwritten(); }

 private:
  std::uint32_t depth_;
  std::deque<int> queue_;
  std::uint64_t truth_ = 0;
  std::uint64_t reported_ = 0;
  QueueCount count_;
};

TEST(QueueCount, IsExactOnAFullQueue) {
  ModelQueue queue{3};
  for (int i = 0; i < 10; ++i) {
    queue.store();
    EXPECT_EQ(queue.reported(), i < 3 ? 0U : static_cast<std::uint64_t>(i - 2));
  }
}

TEST(QueueCount, IsExactOnceTheQueueIsEmpty) {
  ModelQueue queue{2};
  std::mt19937 random{1};
  for (int round = 0; round < 200; ++round) {
    for (auto i = random() % 6; i > 0; --i)
      queue.store();
    while (queue.take()) {
      EXPECT_LE(queue.counted(), queue.truth());
    }
    EXPECT_EQ(queue.counted(), queue.truth());
  }
}

TEST(QueueCount, IsNeverTooHighInBetween) {
  ModelQueue queue{4};
  std::mt19937 random{2};
  for (int step = 0; step < 5000; ++step) {
    if (random() % 2 == 0) {
      queue.store();
    } else {
      queue.take();
    }
    EXPECT_LE(queue.counted(), queue.truth());
  }
}

TEST(QueueCount, DoesNotCountASampleThatIsBeingTaken) {
  QueueCount count{1};
  EXPECT_EQ(count.on_stored(), 0U);
  const auto before = count.begin_take();  // the sample is on its way out
  EXPECT_EQ(count.on_stored(), 0U);
  count.end_take(TakeOutcome::sample, before);
}

TEST(QueueCount, DoesNotTakeANoticeForASample) {
  QueueCount count{1};
  const auto before = count.begin_take();
  count.end_take(TakeOutcome::other, before);
  count.on_stored();
  EXPECT_EQ(count.on_stored(), 1U);
}

TEST(QueueCount, WithoutABoundOnlyTheEmptyQueueTells) {
  QueueCount count{0};
  for (int i = 0; i < 5; ++i)
    EXPECT_EQ(count.on_stored(), 0U);
  auto before = count.begin_take();
  count.end_take(TakeOutcome::sample, before);
  before = count.begin_take();
  count.end_take(TakeOutcome::empty, before);
  EXPECT_EQ(count.overwritten(), 4U);
}

TEST(QueueCount, SaysHowManyWait) {
  QueueCount count{2};
  EXPECT_EQ(count.queued(), 0U);
  for (int i = 0; i < 3; ++i)  // one more than it holds
    count.on_stored();
  EXPECT_EQ(count.queued(), 2U);
  count.end_take(TakeOutcome::sample, count.begin_take());
  EXPECT_EQ(count.queued(), 1U);
  count.end_take(TakeOutcome::sample, count.begin_take());
  count.end_take(TakeOutcome::empty, count.begin_take());
  EXPECT_EQ(count.queued(), 0U);
}

}  // namespace
}  // namespace cie::scheduling
