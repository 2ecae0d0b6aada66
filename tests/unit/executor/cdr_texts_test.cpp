// Texts with a zero inside, in messages that came as bytes.
#include "dds/cdr_texts.hpp"

#include <cie/executor/message.hpp>

#include "dds/cdr_bytes.hpp"
#include "dds/message_layout.hpp"

#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <cie_ros_messages.hpp>
#include <gtest/gtest.h>
#include <test_texts.hpp>

namespace cie::executor {
namespace {

using test_texts::Everything;

// Bytes of a message as Cyclone writes them, which holds texts "mark001" and so on.
template <typename T>
class Marked {
 public:
  explicit Marked(const T& message) : bytes_(cdr_of(layout_, &message)) {
    const CdrBytes bytes{bytes_.get()};
    const std::string_view all{reinterpret_cast<const char*>(bytes.message()),
                               bytes.size() - CdrBytes::kEncoding};
    for (auto at = all.find("mark"); at != std::string_view::npos; at = all.find("mark", at + 1))
      marks_.push_back(at);
  }
  // Where the texts are.
  const std::vector<std::size_t>& marks() const { return marks_; }
  bool have_inner_zero() const {
    return layout_.texts().have_inner_zero(CdrBytes{bytes_.get()}.message());
  }
  void put(std::size_t at, unsigned char byte) const {
    CdrBytes{bytes_.get()}.message()[at] = byte;
  }

 private:
  MessageLayout layout_{MessageTraits<T>::descriptor()};
  CdrBytesPtr bytes_;
  std::vector<std::size_t> marks_;
};

// Texts that are all different, each of seven characters.
class Marks {
 public:
  std::string next() { return "mark" + std::to_string(++made_ + 100); }
  void put(char*& field) { set_text(field, next()); }
  void put(char (&field)[8]) { std::memcpy(field, next().c_str(), sizeof field); }
  template <typename Sequence>
  void put_all(Sequence& sequence, std::uint32_t length) {
    resize(sequence, length);
    for (std::uint32_t i = 0; i < length; ++i)
      put(sequence._buffer[i]);
  }
  void put(test_texts_Inner& inner) { put(inner.name); }
  std::size_t made() const { return made_; }

 private:
  std::size_t made_ = 0;
};

void fill(Everything& message, Marks& marks, std::uint32_t lengths) {
  marks.put(message.plain);
  marks.put(message.bounded);
  message.yes = true;
  marks.put(message.after_flags);
  resize(message.bytes, lengths);
  resize(message.doubles, lengths);
  marks.put(message.after_doubles);
  marks.put_all(message.names, lengths);
  marks.put_all(message.short_names, lengths);
  marks.put_all(message.few, lengths);
  for (auto& text : message.two)
    marks.put(text);
  for (auto& text : message.two_short)
    marks.put(text);
  marks.put(message.inner);
  for (auto& inner : message.inners)
    marks.put(inner);
  marks.put_all(message.more, lengths);
  marks.put_all(message.few_more, lengths);
  resize(message.lists, lengths);
  for (std::uint32_t i = 0; i < lengths; ++i)
    marks.put_all(message.lists._buffer[i], i);
  resize(message.colours, lengths);
  resize(message.all_flags, lengths);
  marks.put(message.last);
  resize(message.tail, lengths);
}

TEST(CdrTexts, AreFoundWhereverAMessageMayHaveThem) {
  for (std::uint32_t lengths = 0; lengths <= 3; ++lengths) {
    const auto message = make_message<Everything>();
    Marks marks;
    fill(*message, marks, lengths);
    const Marked<Everything> bytes{*message};
    ASSERT_EQ(bytes.marks().size(), marks.made());
    EXPECT_FALSE(bytes.have_inner_zero()) << lengths;
    for (const std::size_t at : bytes.marks()) {
      for (const std::size_t inside : {at, at + 6}) {
        bytes.put(inside, 0);
        EXPECT_TRUE(bytes.have_inner_zero()) << lengths << ", " << inside;
        bytes.put(inside, 'x');
      }
    }
    EXPECT_FALSE(bytes.have_inner_zero()) << lengths;
  }
}

TEST(CdrTexts, AreFoundInMessagesOfRos2) {
  const auto cloud = make_message<sensor_msgs::msg::PointCloud2>();
  Marks marks;
  marks.put(cloud->header.frame_id);
  resize(cloud->fields, 3);
  for (std::uint32_t i = 0; i < 3; ++i)
    marks.put(cloud->fields._buffer[i].name);
  resize(cloud->data, 1000);  // zeros, and no text
  const Marked<sensor_msgs::msg::PointCloud2> bytes{*cloud};
  ASSERT_EQ(bytes.marks().size(), 4U);
  EXPECT_FALSE(bytes.have_inner_zero());
  for (const std::size_t at : bytes.marks()) {
    bytes.put(at + 3, 0);
    EXPECT_TRUE(bytes.have_inner_zero());
    bytes.put(at + 3, 'k');
  }
}

TEST(CdrTexts, OfATypeWithoutAnyAreNone) {
  const auto pose = make_message<geometry_msgs::msg::Pose>();
  EXPECT_FALSE(Marked<geometry_msgs::msg::Pose>{*pose}.have_inner_zero());
}

}  // namespace
}  // namespace cie::executor
