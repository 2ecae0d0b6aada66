// Texts in messages that came as bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cie::executor {

// Finds texts with a zero inside, as a std::string of another process may have it: in memory our
// messages' texts end at the first zero, and would be cut there. Of a type that
// MessageLayout::is_plain().
class CdrTexts {
 public:
  // `operations` is the program of Cyclone's serialiser, and stays where it is.
  explicit CdrTexts(const std::vector<std::uint32_t>& operations);

  // Of a message in plain CDR and in this machine's byte order that was checked to be one of the
  // type. Looks no further than the last text may be.
  bool have_inner_zero(const unsigned char* message) const noexcept;
  // Whether a message of the type may have any.
  bool are_possible() const noexcept { return begin_ != end_; }

 private:
  const std::uint32_t* begin_;
  const std::uint32_t* end_;  // behind the last instruction with texts; begin_ without any
};

}  // namespace cie::executor
