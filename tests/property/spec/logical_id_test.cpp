// A logical id is taken apart into what it was made of, whatever that is.
#include <cie/tracepoints/logical_id.hpp>

#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace cie {
namespace {

// Half of the letters are those that ids are made with.
std::string any_text_without(std::string_view marks) {
  const auto letter =
      rc::gen::suchThat(rc::gen::oneOf(rc::gen::element('@', '(', ')', '#', '*', '/', '?', '2'),
                                       rc::gen::arbitrary<char>()),
                        [marks](char c) { return marks.find(c) == std::string_view::npos; });
  return *rc::gen::container<std::string>(letter);
}

TEST(LogicalIdLaw, IsTakenApartIntoWhatItWasMadeOf) {
  EXPECT_TRUE(rc::check([] {
    const auto node = any_text_without("@");
    const auto kind = any_text_without("(");
    const auto what = any_text_without("");
    const auto plain = logical_id(node, kind, what);
    const auto number = *rc::gen::inRange(1, 1000);
    const auto id = number == 1 ? plain : plain + '#' + std::to_string(number);
    const auto parts = LogicalId::parse(id);
    RC_ASSERT(parts.has_value());
    RC_ASSERT(parts->node == node);
    RC_ASSERT(parts->kind == kind);
    RC_ASSERT(parts->what == what);
    RC_ASSERT(parts->number == (number == 1 ? "" : std::to_string(number)));
    RC_ASSERT(LogicalId::node_of(id) == node);
    RC_ASSERT(LogicalId::kind_of(id) == kind);
    RC_ASSERT(LogicalId::without_number(id) == plain);
  }));
}

TEST(LogicalIdLaw, OnlyWhatIsMadeSoIsTakenApart) {
  EXPECT_TRUE(rc::check([] {
    const auto text = any_text_without("");
    const auto parts = LogicalId::parse(text);
    if (!parts) return;
    auto made = logical_id(parts->node, parts->kind, parts->what);
    if (!parts->number.empty()) made.append("#").append(parts->number);
    RC_ASSERT(made == text);
  }));
}

}  // namespace
}  // namespace cie
