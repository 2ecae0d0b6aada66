// Messages in a user's hands: texts and sequences that the message owns (the sanitizers count).
#include <cie/executor/message.hpp>

#include <stdexcept>
#include <string_view>

#include <cie_ros_messages.hpp>
#include <dds/dds.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

TEST(MessageContents, KeepTheirElementsWhenASequenceGrows) {
  const auto joints = make_message<sensor_msgs::msg::JointState>();
  resize(joints->position, 2);
  joints->position._buffer[1] = 0.5;
  resize(joints->position, 1000);
  EXPECT_EQ(joints->position._buffer[1], 0.5);
  EXPECT_EQ(joints->position._buffer[999], 0.0);
}

TEST(MessageContents, OwnTextsInASequence) {
  const auto joints = make_message<sensor_msgs::msg::JointState>();
  resize(joints->name, 1);
  set_text(joints->name._buffer[0], "elbow");
  resize(joints->name, 3);
  set_text(joints->name._buffer[2], "wrist");
  EXPECT_STREQ(joints->name._buffer[0], "elbow");
  EXPECT_EQ(joints->name._buffer[1], nullptr);
  EXPECT_STREQ(joints->name._buffer[2], "wrist");
  resize(joints->name, 1);  // what is beyond is freed with the message, or used again
  EXPECT_EQ(joints->name._length, 1U);
}

TEST(MessageContents, OwnStructsInASequence) {
  const auto cloud = make_message<sensor_msgs::msg::PointCloud2>();
  resize(cloud->fields, 1);
  set_text(cloud->fields._buffer[0].name, "x");
  cloud->fields._buffer[0].datatype = sensor_msgs_msg_PointField_Constants_FLOAT32;
  resize(cloud->fields, 4);
  EXPECT_STREQ(cloud->fields._buffer[0].name, "x");
  EXPECT_EQ(cloud->fields._buffer[0].datatype, 7);
  EXPECT_EQ(cloud->fields._buffer[3].name, nullptr);
}

TEST(MessageContents, HaveNoTextThatWouldBeCut) {
  const auto text = make_message<std_msgs::msg::String>();
  set_text(text->data, "before");
  try {
    set_text(text->data, std::string_view{"ab\0cd", 5});
    FAIL() << "was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "a text of 5 bytes has a zero behind the first 2: a message's texts end there");
  }
  EXPECT_STREQ(text->data, "before");
}

TEST(MessageTypes, OfRos2HaveItsNamesOnTheWire) {
  EXPECT_STREQ(MessageTraits<std_msgs::msg::String>::descriptor().m_typename,
               "std_msgs::msg::dds_::String_");
  EXPECT_STREQ(MessageTraits<sensor_msgs::msg::PointCloud2>::descriptor().m_typename,
               "sensor_msgs::msg::dds_::PointCloud2_");
}

}  // namespace
}  // namespace cie
