// What is read from pages of the kernel's ring buffer, and what becomes of each record.
#include "kernel/kernel_events.hpp"

#include "kernel/kernel_record.h"
#include "kernel_pages.hpp"
#include "system/error.hpp"

#include <cstddef>
#include <cstring>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace cie::record {
namespace {

using test::bytes_of;
using test::PageText;

std::string text_of(std::span<const std::byte> data) {
  return {reinterpret_cast<const char*>(data.data()), data.size()};
}

// "TIME:DATA" of every record.
std::vector<std::string> records_of(std::vector<std::byte> bytes) {
  RingBufferPage page;
  page.load(bytes);
  std::vector<std::string> records;
  while (const auto record = page.next()) {
    records.push_back(std::to_string(record->time) + ':' + text_of(record->data));
  }
  return records;
}

using Texts = std::vector<std::string>;

TEST(RingBufferPage, TimesAddUpFromThePagesOwn) {
  EXPECT_EQ(records_of(PageText(1000).record(0, "abcd").record(5, "efghijkl").bytes()),
            (Texts{"1000:abcd", "1005:efghijkl"}));
}

TEST(RingBufferPage, AnEmptyPageHasNoRecords) {
  EXPECT_EQ(records_of(PageText(1000).bytes()), Texts{});
}

TEST(RingBufferPage, ALongRecordHasItsLengthInAWordOfItsOwn) {
  const std::string data(200, 'x');
  EXPECT_EQ(records_of(PageText(1000).long_record(3, data).record(1, "tail").bytes()),
            (Texts{"1003:" + data, "1004:tail"}));
}

TEST(RingBufferPage, ATimeExtendLengthensTheNextDifference) {
  const std::uint64_t beyond_27_bits = std::uint64_t{5} << 30U;
  EXPECT_EQ(records_of(PageText(1000).time_extend(beyond_27_bits).record(2, "abcd").bytes()),
            (Texts{std::to_string(1000 + beyond_27_bits + 2) + ":abcd"}));
}

TEST(RingBufferPage, ATimeStampIsAbsolute) {
  EXPECT_EQ(records_of(PageText(1000).time_stamp(9'000'000'000).record(0, "abcd").bytes()),
            (Texts{"9000000000:abcd"}));
}

TEST(RingBufferPage, WhatWasTakenBackIsNoRecordButTakesItsTime) {
  EXPECT_EQ(records_of(PageText(1000).discarded(4, 8).record(1, "abcd").bytes()),
            (Texts{"1005:abcd"}));
}

TEST(RingBufferPage, PaddingEndsThePage) {
  EXPECT_EQ(records_of(PageText(1000).record(1, "abcd").padding().bytes()), (Texts{"1001:abcd"}));
}

TEST(RingBufferPage, TellsHowManyEventsWereOverwrittenBeforeIt) {
  RingBufferPage page;
  auto whole = PageText(1).record(0, "abcd").bytes();
  page.load(whole);
  EXPECT_FALSE(page.has_missed());
  auto counted = PageText(1).record(0, "abcd").missed(17).bytes();
  page.load(counted);
  EXPECT_TRUE(page.has_missed());
  EXPECT_EQ(page.missed_count(), 17U);
  ASSERT_TRUE(page.next().has_value());
  EXPECT_FALSE(page.next().has_value()) << "the count is no record";
  auto uncounted = PageText(1).record(0, "abcd").missed().bytes();
  page.load(uncounted);
  EXPECT_TRUE(page.has_missed());
  EXPECT_EQ(page.missed_count(), std::nullopt);
}

const KernelEventClass& class_of(std::string_view name) {
  for (const KernelEventClass& event_class : kernel_event_classes()) {
    if (event_class.name == name) return event_class;
  }
  throw std::out_of_range(std::string(name));
}

template <typename Integer>
Integer integer_at(const std::string& bytes, std::size_t offset) {
  Integer value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

// Encodes the only record of a page.
class Encoding : public ::testing::Test {
 protected:
  Encoding() {
    encoder_.learn(class_of("sched_switch"), test::switch_format());
    encoder_.learn(class_of("sched_process_fork"), test::fork_format());
    encoder_.learn(class_of("sched_process_exec"), test::exec_format());
  }

  bool encode(const std::string& data) {
    auto bytes = PageText(4711).long_record(0, data).bytes();
    RingBufferPage page;
    page.load(bytes);
    out_.clear();
    return encoder_.encode(page.next().value(), out_);
  }

  KernelEventEncoder encoder_;
  std::string out_;
};

TEST_F(Encoding, WritesASwitchAsLttngModulesDoes) {
  ASSERT_TRUE(encode(bytes_of({.prev_comm = "fusion",
                               .prev_pid = 100,
                               .prev_prio = 79,  // FIFO 20
                               .prev_state = 0x100,
                               .next_comm = "a name too long",
                               .next_pid = 200,
                               .next_prio = -1})));  // DEADLINE
  ASSERT_EQ(out_.size(), 2U + 8 + 16 + 4 + 4 + 8 + 16 + 4 + 4);
  EXPECT_EQ(kernel_event_classes()[integer_at<std::uint16_t>(out_, 0)].name, "sched_switch");
  EXPECT_EQ(integer_at<std::uint64_t>(out_, 2), 4711U);
  EXPECT_EQ(out_.substr(10, 16), std::string("fusion") + std::string(10, '\0'));
  EXPECT_EQ(integer_at<std::int32_t>(out_, 26), 100);
  EXPECT_EQ(integer_at<std::int32_t>(out_, 30), -21) << "LTTng-modules counts from 100";
  EXPECT_EQ(integer_at<std::int64_t>(out_, 34), 0x100);
  EXPECT_EQ(out_.substr(42, 16), std::string("a name too long") + '\0');
  EXPECT_EQ(integer_at<std::int32_t>(out_, 58), 200);
  EXPECT_EQ(integer_at<std::int32_t>(out_, 62), -101);
}

std::string fork_record(std::uint32_t parent_location, std::uint32_t child_location,
                        const std::string& text) {
  std::string bytes(24, '\0');
  const auto put = [&bytes](std::size_t offset, auto value) {
    std::memcpy(bytes.data() + offset, &value, sizeof value);
  };
  put(0, test::kForkNumber);
  put(8, parent_location);
  put(12, std::int32_t{10});
  put(16, child_location);
  put(20, std::int32_t{11});
  return bytes + text;
}

TEST_F(Encoding, FollowsTheLocationOfAName) {
  const std::string text("mother\0child\0\0\0", 15);
  ASSERT_TRUE(encode(fork_record(24U | 7U << 16U, 31U | 6U << 16U, text)));
  ASSERT_EQ(out_.size(), 2U + 8 + 16 + 4 + 16 + 4);
  EXPECT_STREQ(out_.substr(10, 16).c_str(), "mother");
  EXPECT_EQ(integer_at<std::int32_t>(out_, 26), 10);
  EXPECT_STREQ(out_.substr(30, 16).c_str(), "child");
  EXPECT_EQ(integer_at<std::int32_t>(out_, 46), 11);
}

TEST_F(Encoding, ANameThatLiesOutsideItsRecordIsEmpty) {
  ASSERT_TRUE(encode(fork_record(4000U | 7U << 16U, 26U | 60'000U << 16U, "abcdefgh")));
  EXPECT_STREQ(out_.substr(10, 16).c_str(), "");
  EXPECT_STREQ(out_.substr(30, 16).c_str(), "cdefgh");
}

// Its path is of any length, and left out.
TEST_F(Encoding, TellsWhichThreadExecutesAnotherProgramAndWhatItIsCalledThen) {
  std::string record(20, '\0');
  const auto put = [&record](std::size_t offset, auto value) {
    std::memcpy(record.data() + offset, &value, sizeof value);
  };
  put(0, test::kExecNumber);
  put(8, 20U | 10U << 16U);
  put(12, std::int32_t{100});
  put(16, std::int32_t{107});
  ASSERT_TRUE(encode(record + std::string("/bin/true\0\0\0", 12)));
  ASSERT_EQ(out_.size(), 2U + 8 + 4 + 4);
  EXPECT_EQ(kernel_event_classes()[integer_at<std::uint16_t>(out_, 0)].name, "sched_process_exec");
  EXPECT_EQ(integer_at<std::int32_t>(out_, 10), 100);
  EXPECT_EQ(integer_at<std::int32_t>(out_, 14), 107);
}

TEST_F(Encoding, LeavesOutWhatItDoesNotKnowAndWhatIsCutShort) {
  std::string other = bytes_of(test::SwitchRecord{});
  other[0] = '\x01';
  EXPECT_FALSE(encode(other));
  EXPECT_FALSE(encode(bytes_of(test::SwitchRecord{}).substr(0, 60)));
  EXPECT_TRUE(out_.empty());
}

TEST(KernelEventClasses, AreTheStructuresThatTheBpfProgramsFill) {
  const std::vector<std::tuple<int, std::string, std::size_t>> structures{
      {CIE_SCHED_SWITCH, "sched_switch", sizeof(cie_sched_switch)},
      {CIE_SCHED_WAKING, "sched_waking", sizeof(cie_sched_wake)},
      {CIE_SCHED_WAKEUP, "sched_wakeup", sizeof(cie_sched_wake)},
      {CIE_SCHED_WAKEUP_NEW, "sched_wakeup_new", sizeof(cie_sched_wake)},
      {CIE_SCHED_PROCESS_FORK, "sched_process_fork", sizeof(cie_sched_process_fork)},
      {CIE_SCHED_PROCESS_EXIT, "sched_process_exit", sizeof(cie_sched_process_exit)},
      {CIE_SCHED_MIGRATE_TASK, "sched_migrate_task", sizeof(cie_sched_migrate_task)},
      {CIE_SCHED_PI_SETPRIO, "sched_pi_setprio", sizeof(cie_sched_pi_setprio)},
      {CIE_SCHED_PROCESS_EXEC, "sched_process_exec", sizeof(cie_sched_process_exec)}};
  const auto& classes = kernel_event_classes();
  ASSERT_EQ(classes.size(), structures.size());
  for (const auto& [id, name, size] : structures) {
    EXPECT_EQ(classes[static_cast<std::size_t>(id)].name, name);
    EXPECT_EQ(recorded_size(classes[static_cast<std::size_t>(id)]), size) << name;
  }
  EXPECT_EQ(offsetof(cie_sched_switch, prev.thread.tid), 26U) << "as in WritesASwitch";
  EXPECT_EQ(offsetof(cie_sched_switch, next.thread.tid), 58U);
}

TEST(KernelEventEncoder, RefusesAKernelWhoseEventLacksAField) {
  KernelEventEncoder encoder;
  std::string format = test::switch_format();
  format.replace(format.find("prev_state"), 10, "prev_stuff");
  EXPECT_THROW(encoder.learn(class_of("sched_switch"), format), RecordError);
  EXPECT_THROW(encoder.learn(class_of("sched_switch"), "nonsense"), RecordError);
}

}  // namespace
}  // namespace cie::record
