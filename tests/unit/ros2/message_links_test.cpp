// Which publication a taken message is.
#include "vocabulary/ros2/message_links.hpp"

#include <algorithm>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis::ros2 {
namespace {

const std::string kTopic = "/scan";
constexpr std::size_t kKept = 1024;           // of a topic
constexpr std::int64_t kOffsetError = 2'000;  // how well a tracer knows its clock's offset
constexpr auto kNotYet = std::numeric_limits<std::int64_t>::max();

WrittenMessage call_of_publish(std::uint64_t gid, std::int64_t from, std::int64_t until) {
  return {.gid = gid, .stamp = from, .from = from, .until = until};
}
WrittenMessage stamped(std::uint64_t gid, std::int64_t stamp) {
  return {.gid = gid, .stamp = stamp, .is_exact = true};
}

TEST(MessageLinks, ATimestampBelongsToTheOneCallThatItFallsInto) {
  MessageLinks links;
  links.topic(kTopic).add(call_of_publish(1, 100'000, 110'000));
  links.topic(kTopic).add(call_of_publish(2, 200'000, 210'000));
  EXPECT_EQ(links.find(kTopic, 105'000).gid, 1U);
  EXPECT_EQ(links.find(kTopic, 105'000).stamp, 100'000);
  EXPECT_EQ(links.find(kTopic, 205'000).gid, 2U);
  EXPECT_EQ(links.find(kTopic, 150'000).gid, 0U) << "between the calls";
  EXPECT_EQ(links.find("/other", 105'000).gid, 0U);
}

TEST(MessageLinks, ACallThatGoesOnMayHaveWrittenAnythingSince) {
  MessageLinks links;
  const auto going_on = links.topic(kTopic).add(call_of_publish(1, 100'000, kNotYet));
  links.topic(kTopic).add(call_of_publish(2, 200'000, 210'000));
  EXPECT_EQ(links.find(kTopic, 205'000).gid, 0U) << "two may have written it";
  going_on.get()->until = 190'000;
  EXPECT_EQ(links.find(kTopic, 205'000).gid, 2U);
  links.topic(kTopic).add(call_of_publish(3, 400'000, kNotYet));
  EXPECT_EQ(links.find(kTopic, 500'000).gid, 3U);
  EXPECT_EQ(links.find(kTopic, 300'000).gid, 0U);
}

// Who takes a message may run before its publication is told.
TEST(MessageLinks, ACallThatHasNotToldItsTimestampYetLeavesItUndecided) {
  MessageLinks links;
  links.topic(kTopic).add_publisher(1);
  links.topic(kTopic).add(stamped(1, 50'000));
  links.topic(kTopic).begin_call(100'000);
  EXPECT_EQ(links.find(kTopic, 105'000).gid, 1U) << "the only publisher's";
  EXPECT_EQ(links.find(kTopic, 105'000).stamp, 105'000);
  links.topic(kTopic).add_publisher(2);
  EXPECT_TRUE(links.find(kTopic, 105'000).is_undecided) << "of which one?";
  EXPECT_FALSE(links.find(kTopic, 90'000).is_undecided) << "written before it began";
  EXPECT_EQ(links.find(kTopic, 90'000).gid, 0U);
  links.topic(kTopic).end_call(100'000);
  links.topic(kTopic).add(stamped(1, 110'000));
  EXPECT_FALSE(links.find(kTopic, 105'000).is_undecided) << "another one's";
  EXPECT_EQ(links.find(kTopic, 110'000).gid, 1U);
}

TEST(MessageLinks, WhatSeveralMayHaveWrittenIsUndecided) {
  MessageLinks links;
  links.topic(kTopic).add(call_of_publish(1, 100'000, 110'000));
  links.topic(kTopic).add(call_of_publish(2, 104'000, 114'000));
  EXPECT_TRUE(links.find(kTopic, 107'000).is_undecided);
  EXPECT_FALSE(links.find(kTopic, 113'000).is_undecided) << "the second alone";
  EXPECT_FALSE(links.find(kTopic, 200'000).is_undecided) << "of nobody who is known";
  links.topic(kTopic).add(stamped(3, 300'000));
  links.topic(kTopic).add(stamped(4, 300'000));
  EXPECT_TRUE(links.find(kTopic, 300'000).is_undecided);
}

// The clock that stamps messages was set: none fits any more. Whoever else publishes leaves
// publications that messages fit.
TEST(MessageLinks, MessagesThatFitNothingAnyMoreAreUndecided) {
  constexpr std::int64_t kPeriod = 100'000;
  const auto last_is_undecided = [](std::int64_t set, bool is_taken) {
    MessageLinks links;
    MessageLinks::Origin last;
    for (std::int64_t k = 1; k <= 12; ++k) {
      links.topic(kTopic).add(call_of_publish(1, k * kPeriod, k * kPeriod + 10'000));
      if (is_taken || k < 5) links.find(kTopic, k * kPeriod + 5'000);
      if (k >= 5) last = links.find(kTopic, k * kPeriod + 5'000 + set);
    }
    return last.is_undecided;
  };
  EXPECT_TRUE(last_is_undecided(-30'000, false));
  EXPECT_TRUE(last_is_undecided(50'000'000, false));
  EXPECT_FALSE(last_is_undecided(-30'000, true)) << "somebody else wrote these";
}

// Its callback works on for long, and somebody who is not recorded publishes meanwhile.
TEST(MessageLinks, ACallWritesOneMessage) {
  MessageLinks links;
  links.topic(kTopic).add(call_of_publish(1, 100'000, 60'000'000));
  EXPECT_EQ(links.find(kTopic, 103'000).gid, 1U);
  EXPECT_EQ(links.find(kTopic, 20'000'000).gid, 0U) << "of another writer";
  EXPECT_TRUE(links.find(kTopic, 103'000).is_undecided) << "that one may have written this, too";
}

// Where it writes is not known, so whatever falls into a call may be of either.
TEST(MessageLinks, WhoeverIsNotRecordedMayWriteWithinCallsAsWell) {
  MessageLinks links;
  links.topic(kTopic).add_publisher(1);
  links.topic(kTopic).add(call_of_publish(1, 100'000, 110'000));
  links.topic(kTopic).add(call_of_publish(1, 200'000, 210'000));
  links.topic(kTopic).add(call_of_publish(1, 300'000, 310'000));
  EXPECT_FALSE(links.find(kTopic, 50'000).shows_unseen_writer) << "the only publisher's, earlier";
  EXPECT_EQ(links.find(kTopic, 105'000).gid, 1U);
  EXPECT_TRUE(links.find(kTopic, 150'000).shows_unseen_writer);
  EXPECT_FALSE(links.find(kTopic, 160'000).shows_unseen_writer) << "told once";
  EXPECT_TRUE(links.find(kTopic, 205'000).is_undecided);
  links.topic(kTopic).add(stamped(2, 400'000));
  EXPECT_EQ(links.find(kTopic, 400'000).gid, 2U) << "a timestamp is a proof";
}

// Clocks are as coarse as they are; messages of one timestamp are nobody's more than another's.
TEST(MessageLinks, ATimestampOfTwoPublicationsIsOfNeither) {
  MessageLinks links;
  links.topic(kTopic).add(stamped(1, 100'000));
  links.topic(kTopic).add(stamped(2, 200'000));
  EXPECT_EQ(links.find(kTopic, 200'000).gid, 2U);
  links.topic(kTopic).add(stamped(3, 200'000));
  EXPECT_EQ(links.find(kTopic, 200'000).gid, 0U);
  EXPECT_EQ(links.find(kTopic, 200'000).stamp, 200'000);
  EXPECT_EQ(links.find(kTopic, 100'000).gid, 1U);
  links.topic("/other").add(stamped(4, 100'000));
  EXPECT_EQ(links.find(kTopic, 100'000).gid, 1U) << "topics have nothing to do with each other";
}

// Where one writer is known and what it wrote is remembered, others are there as well.
TEST(MessageLinks, WhatNoCallOfTheOnlyPublisherFitsIsOfAnother) {
  MessageLinks links;
  links.topic(kTopic).add_publisher(7);
  EXPECT_EQ(links.find(kTopic, 50'000).gid, 7U) << "nothing is known of when it wrote";
  links.topic(kTopic).add(stamped(7, 100'000));
  links.topic(kTopic).add(stamped(7, 200'000));
  EXPECT_EQ(links.find(kTopic, 50'000).gid, 7U) << "before what is remembered";
  EXPECT_EQ(links.find(kTopic, 150'000).gid, 0U);
  EXPECT_EQ(links.find(kTopic, 150'000).stamp, 150'000);
  links.lose();
  EXPECT_EQ(links.find(kTopic, 150'000).gid, 7U) << "that publication may have been lost";
}

// Of processes on several machines, and of those that two sessions record.
TEST(MessageLinks, WhatIsWrittenAfterTheEndOfItsPublishersRecordIsUnknown) {
  constexpr std::uint32_t kFirst = 10;
  constexpr std::uint32_t kSecond = 20;
  MessageLinks links;
  links.topic(kTopic).add_publisher(7);
  std::optional<std::uint32_t> told_in;
  links.topic(kTopic).tell_in(kFirst, told_in);
  links.topic(kTopic).add(stamped(7, 100'000));
  links.end_channel(30, 110'000);
  EXPECT_EQ(links.find(kTopic, 210'000).gid, 0U) << "another one's record has ended";
  links.topic(kTopic).tell_in(kSecond, told_in);
  links.topic(kTopic).add(stamped(7, 150'000));
  links.end_channel(kFirst, 160'000);
  EXPECT_EQ(links.find(kTopic, 210'000).gid, 0U) << "the second channel tells it";
  links.end_channel(kSecond, 200'000);
  EXPECT_EQ(links.find(kTopic, 199'999).gid, 0U);
  EXPECT_EQ(links.find(kTopic, 200'000).gid, 7U);
  links.topic(kTopic).add_publisher(8);
  EXPECT_FALSE(links.find(kTopic, 199'999).is_undecided);
  EXPECT_TRUE(links.find(kTopic, 200'000).is_undecided) << "either's";
}

// A message may wait for as long as the queue of its subscription is.
TEST(MessageLinks, WhatManyPublicationsFollowedIsOfNoOtherWriter) {
  MessageLinks links;
  links.topic(kTopic).add_publisher(7);
  links.topic(kTopic).add_publisher(8);
  constexpr auto kPublications = static_cast<std::int64_t>(kKept) + 2;
  for (std::int64_t i = 1; i <= kPublications; ++i) {
    links.topic(kTopic).add(stamped(7, i * 100),
                            AgnocastMessage{.entry = {.host = 0, .number = i}});
  }
  EXPECT_EQ(links.find(kTopic, 300).gid, 7U) << "the first that is remembered";
  EXPECT_TRUE(links.find(kTopic, 200).is_undecided);
  EXPECT_TRUE(links.find(kTopic, 100).is_undecided);
  EXPECT_FALSE(links.find(kTopic, 99).is_undecided) << "written before the recording";
  EXPECT_FALSE(links.find(kTopic, 350).is_undecided) << "all of that time are remembered";
  EXPECT_TRUE(links.find_entry(kTopic, {.host = 0, .number = 2}).is_undecided);
  EXPECT_EQ(links.find_entry(kTopic, {.host = 0, .number = 3}).gid, 7U);
}

TEST(MessageLinks, WhatSomebodyUnannouncedPublishedIsUndecided) {
  MessageLinks links;
  links.unannounced().add(stamped(0, 100'000));
  EXPECT_TRUE(links.find(kTopic, 100'000).is_undecided);
  EXPECT_FALSE(links.find(kTopic, 100'001).is_undecided);
  links.topic(kTopic).add_publisher(7);
  links.topic(kTopic).add(stamped(7, 50'000));
  EXPECT_TRUE(links.find(kTopic, 100'000).is_undecided);
  EXPECT_FALSE(links.find(kTopic, 100'001).is_undecided);
}

// Its topic is not known, so it may be any.
TEST(MessageLinks, ACallOfSomebodyUnannouncedMayHaveWrittenIt) {
  MessageLinks links;
  links.topic(kTopic).add_publisher(7);
  links.topic(kTopic).add(call_of_publish(7, 100'000, 8'000'000));
  links.unannounced().add(call_of_publish(0, 5'000'000, 5'010'000));
  EXPECT_TRUE(links.find(kTopic, 5'005'000).is_undecided);
  EXPECT_EQ(links.find(kTopic, 103'000).gid, 7U);
}

TEST(MessageLinks, NothingIsOfACallThatIsDoubtful) {
  MessageLinks links;
  links.topic(kTopic).add_publisher(7);
  links.topic(kTopic).add_publisher(8);
  links.topic(kTopic).add(call_of_publish(7, 100'000, 8'000'000));
  links.topic(kTopic).add(call_of_publish(8, 5'000'000, 9'000'000)).get()->is_doubtful = true;
  EXPECT_TRUE(links.find(kTopic, 5'005'000).is_undecided) << "either may have written it";
  EXPECT_TRUE(links.find(kTopic, 8'500'000).is_undecided);
  EXPECT_EQ(links.find(kTopic, 103'000).gid, 7U);
}

// By another host's clock, which is ahead: whoever wrote it tells that later.
TEST(MessageLinks, WhatWasTakenBeforeItWasWrittenIsOfWhoeverTellsItLater) {
  constexpr MessageLinks::Take kNow{.told_until = 150'000};
  MessageLinks links;
  EXPECT_TRUE(links.find(kTopic, 200'000, kNow).is_undecided) << "nobody is known yet";
  links.topic(kTopic).add_publisher(7);
  links.topic(kTopic).add(stamped(7, 100'000));
  EXPECT_EQ(links.find(kTopic, 200'000, kNow).gid, 7U);
  EXPECT_EQ(links.find(kTopic, 200'000, kNow).stamp, 200'000) << "by which it will be known";
  EXPECT_EQ(links.find(kTopic, 140'000, kNow).gid, 0U) << "that was told: another one wrote it";
  links.topic(kTopic).add_publisher(8);
  EXPECT_TRUE(links.find(kTopic, 200'000, kNow).is_undecided) << "of which of the two?";
  const std::string calls = "/calls";
  links.topic(calls).add_publisher(9);
  links.topic(calls).add(call_of_publish(9, 100'000, 300'000));
  EXPECT_TRUE(links.find(calls, 200'000, kNow).is_undecided) << "another call may follow";
  EXPECT_TRUE(links.find(calls, 400'000, kNow).is_undecided);
}

// The clock was set forward since it was written: whichever message it is, it need not be of the call
// that goes on.
TEST(MessageLinks, AMessageFromTheFutureIsNotProvenToBeOfTheCallThatGoesOn) {
  MessageLinks links;
  links.topic(kTopic).add_publisher(1);
  const auto going_on = links.topic(kTopic).add(call_of_publish(1, 100'000, kNotYet));
  EXPECT_TRUE(links.find(kTopic, 1'000'000, {.at = 120'000}).is_undecided);
  EXPECT_EQ(links.find(kTopic, 110'000, {.at = 120'000}).gid, 1U) << "it was written before";
  going_on.get()->until = 130'000;
  links.topic(kTopic).add(stamped(1, 2'000'000));
  EXPECT_EQ(links.find(kTopic, 2'000'000, {.at = 140'000}).gid, 1U) << "a timestamp is a proof";
}

// With one publisher it would be that one's.
TEST(MessageLinks, WhatFitsNoCallIsUndecidedWhereOneOfSeveralPublishersMayHaveLostIt) {
  MessageLinks links;
  links.topic(kTopic).add_publisher(7);
  links.topic(kTopic).add_publisher(8);
  links.topic(kTopic).add(stamped(7, 100'000));
  EXPECT_FALSE(links.find(kTopic, 150'000).is_undecided) << "of another writer";
  links.lose();
  EXPECT_TRUE(links.find(kTopic, 150'000).is_undecided);
}

// Numbers begin again in each IPC namespace, and where nobody had the topic any more.
TEST(MessageLinks, ANumberIsOfItsLatestPublicationUnlessAnotherProcessHasPublishedByIt) {
  MessageLinks links;
  const auto add = [&](std::uint64_t gid, std::int64_t stamp, std::int64_t pid) {
    links.topic(kTopic).add({.gid = gid, .stamp = stamp},
                            AgnocastMessage{.entry = {.host = 0, .number = 5}, .pid = pid});
  };
  add(1, 100, 1);
  add(2, 200, 1);
  EXPECT_EQ(links.find_entry(kTopic, {.host = 0, .number = 5}).gid, 2U);
  EXPECT_EQ(links.find_entry(kTopic, {.host = 0, .number = 6}).gid, 0U);
  add(3, 300, 7);
  EXPECT_TRUE(links.find_entry(kTopic, {.host = 0, .number = 5}).is_undecided);
  EXPECT_EQ(links.find_entry(kTopic, {.host = 0, .number = 5}).gid, 0U);
  EXPECT_FALSE(links.find_entry(kTopic, {.host = 1, .number = 5}).is_undecided);
}

// Not looked at are only those of which none can be it: the same as looking at all that are kept.
TEST(MessageLinks, FindsWhatLookingAtAllWouldFind) {
  std::mt19937 random(14);
  const auto below = [&random](std::int64_t bound) {
    return static_cast<std::int64_t>(random()) % bound;
  };
  MessageLinks links;
  std::deque<WrittenMessage> all;
  std::map<const WrittenMessage*, std::int64_t> taken;
  const auto plainly_found = [&all, &taken](std::int64_t stamp) {
    const WrittenMessage* exact = nullptr;
    const WrittenMessage* found = nullptr;
    int candidates = 0;
    const auto kept = std::min(kKept, all.size());
    for (auto each = all.rbegin(); each != all.rbegin() + static_cast<std::ptrdiff_t>(kept);
         ++each) {
      const auto& message = *each;
      if (message.is_exact) {
        if (message.stamp != stamp) continue;
        if (exact != nullptr) return std::uint64_t{0};
        exact = &message;
      } else if (stamp >= message.from - kOffsetError && stamp <= message.until) {
        const auto other = taken.find(&message);
        if (other != taken.end() && other->second != stamp) continue;
        found = &message;
        ++candidates;
      }
    }
    if (exact != nullptr) return exact->gid;
    if (candidates != 1) return std::uint64_t{0};
    taken[found] = stamp;
    return found->gid;
  };
  const auto tell = [&](const WrittenMessage& message) {
    all.push_back(message);
    return links.topic(kTopic).add(message);
  };
  std::vector<std::pair<WrittenMessage*, WrittenRef>> going_on;
  std::int64_t now = 1'000'000;
  std::uint64_t gid = 0;
  int differences = 0;
  int found = 0;
  for (int step = 0; step < 20'000; ++step) {
    now += below(3'000);
    switch (below(4)) {
      case 0:
        tell(stamped(++gid, now - below(20'000)));
        break;
      case 1:
        if (const auto told = tell(call_of_publish(++gid, now, kNotYet)); step % 4'000 >= 4)
          going_on.emplace_back(&all.back(), told);  // else it never ends
        break;
      case 2:
        tell(call_of_publish(++gid, now - below(9'000), now));
        break;
      default:
        for (const auto& [message, told] : going_on) {
          message->until = now;
          if (told.get() != nullptr) told.get()->until = now;
        }
        going_on.clear();
    }
    // The latest one tells its timestamp: what fits none is of somebody else, and shows no more.
    tell(stamped(++gid, -1'000'000'000 - step));
    const auto asked = now - below(step % 10 == 0 ? 2'000'000 : 10'000);
    const auto answer = links.find(kTopic, asked).gid;
    if (answer != 0) ++found;
    if (answer != plainly_found(asked)) ++differences;
    const auto& latest = all[all.size() - 2];
    if (latest.is_exact) {
      EXPECT_EQ(links.find(kTopic, latest.stamp).gid, plainly_found(latest.stamp));
    }
  }
  EXPECT_EQ(differences, 0);
  EXPECT_GT(found, 2'000) << "else this test would tell little";
}

}  // namespace
}  // namespace cie::analysis::ros2
