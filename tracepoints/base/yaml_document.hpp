// A YAML document from an untrusted file, as values that know where they stand. yaml-cpp parses;
// the tree is ours, so that depth, size and aliases are bounded and every message has a line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::yaml {

struct TreeNode {
  enum class Kind : std::uint8_t { null, scalar, sequence, map };
  Kind kind = Kind::null;
  int line = 1;
  std::string text;  // of a scalar
  std::vector<std::shared_ptr<const TreeNode>>
      items;  // of a sequence; of a map: key, value, key, …
};

// One value of the document and what it belongs to. Cheap to copy; valid as long as its Document.
// Every function that expects a shape throws SpecError when it finds another.
class Value {
 public:
  Value(const TreeNode& node, std::string_view file) : node_(&node), file_(file) {}

  int line() const noexcept { return node_->line; }
  bool is_null() const noexcept { return node_->kind == TreeNode::Kind::null; }
  bool is_scalar() const noexcept { return node_->kind == TreeNode::Kind::scalar; }
  bool is_sequence() const noexcept { return node_->kind == TreeNode::Kind::sequence; }
  bool is_map() const noexcept { return node_->kind == TreeNode::Kind::map; }
  bool is_empty_sequence() const noexcept { return is_sequence() && node_->items.empty(); }

  // `what` names the value in messages: "affinity".
  const std::string& text(std::string_view what) const;
  std::vector<Value> items(std::string_view what) const;
  // Keys are text and occur once.
  std::vector<std::pair<std::string, Value>> fields(std::string_view what) const;
  // Of such a map: the key itself. What stands at an anchor has the anchor's line, its key its own.
  Value key(std::string_view name) const;
  // Decimal digits with an optional minus sign, exactly: neither fraction, exponent, other base nor
  // leading zero, and within [min, max].
  std::int64_t integer(std::string_view what, std::int64_t min, std::int64_t max) const;
  // Nanoseconds: such a number, or one with a unit: "5ms", "1.5us" (cie/tracepoints/duration_text.hpp).
  std::int64_t duration(std::string_view what, std::int64_t min, std::int64_t max) const;

  // The same value; messages say that it belongs to `entry`.
  Value of_entry(std::string_view entry) const;
  // "FILE:LINE: entry "ID": message".
  [[noreturn]] void fail(std::string_view message) const;

 private:
  const TreeNode* node_;
  std::string_view file_;
  std::string entry_;
};

// Parses exactly one document. Throws SpecError for anything else: other encodings than UTF-8,
// control characters, more than 4 MiB, nesting beyond 64, bad syntax, a second document.
std::shared_ptr<const TreeNode> parse(std::string_view text, std::string_view file,
                                      std::string_view example);

// The file's bytes, at most one more than parse() accepts. Throws SpecError when it cannot be read.
std::string read_file(const std::filesystem::path& file);

}  // namespace cie::yaml
