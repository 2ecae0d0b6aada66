#include "yaml_document.hpp"

#include <cie/tracepoints/duration_text.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/utf8.hpp>

#include "file.hpp"
#include "text.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <system_error>

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

namespace cie::yaml {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{4} << 20U;
constexpr std::size_t kMaxDepth = 64;

[[noreturn]] void fail_at(std::string_view file, int line, std::string_view message) {
  throw SpecError(std::string(file) + ':' + std::to_string(line) + ": " + std::string(message));
}

int line_of(const YAML::Mark& mark) { return mark.line < 0 ? 1 : mark.line + 1; }

// Builds the tree from yaml-cpp's events. An alias shares the node it names, so that nested aliases
// cost nothing here; readers of the tree bound what they visit.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(std::string_view file) : file_(file) {}

  std::shared_ptr<const TreeNode> take_root() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& /*mark*/) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add(make(TreeNode::Kind::null, mark, anchor));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto target = anchors_.find(anchor);
    if (target == anchors_.end()) {
      fail_at(file_, line_of(mark), "an alias names an anchor that is not defined before it");
    }
    if (std::ranges::find(open_, target->second) != open_.end()) {
      fail_at(file_, line_of(mark), "an alias stands inside the value it names");
    }
    add(target->second);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                const std::string& value) override {
    auto node = make(TreeNode::Kind::scalar, mark, anchor);
    node->text = value;
    add(node);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    begin(make(TreeNode::Kind::sequence, mark, anchor));
  }
  void OnSequenceEnd() override { open_.pop_back(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    begin(make(TreeNode::Kind::map, mark, anchor));
  }
  void OnMapEnd() override { open_.pop_back(); }

 private:
  std::shared_ptr<TreeNode> make(TreeNode::Kind kind, const YAML::Mark& mark,
                                 YAML::anchor_t anchor) {
    auto node = std::make_shared<TreeNode>();
    node->kind = kind;
    node->line = line_of(mark);
    if (anchor != 0) anchors_[anchor] = node;
    return node;
  }
  void add(const std::shared_ptr<TreeNode>& node) {
    if (open_.empty()) {
      root_ = node;
    } else {
      open_.back()->items.push_back(node);
    }
  }
  void begin(const std::shared_ptr<TreeNode>& node) {
    if (open_.size() == kMaxDepth) fail_at(file_, node->line, "nested too deeply; flatten it");
    add(node);
    open_.push_back(node);
  }

  std::string_view file_;
  std::shared_ptr<const TreeNode> root_;
  std::vector<std::shared_ptr<TreeNode>>
      open_;  // sequences and maps not yet ended, outermost first
  std::map<YAML::anchor_t, std::shared_ptr<TreeNode>> anchors_;
};

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

void check_is_text(std::string_view text, std::string_view file) {
  if (text.size() > kMaxBytes) {
    fail_at(file, 1, "larger than 4 MiB; it is meant to be a small YAML file");
  }
  int line = 1;
  for (std::size_t i = 0; i < text.size();) {
    const auto point = first_code_point(text.substr(i));
    const char c = text[i];
    if (!point.is_valid) fail_at(file, line, "not UTF-8; save the file in that encoding");
    if (is_control(c) && c != '\n' && c != '\r' && c != '\t') {
      fail_at(file, line, "holds a control character; write plain YAML text");
    }
    if (c == '\n') ++line;
    i += point.size;
  }
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kShown = 80;
  return '"' + std::string(text.substr(0, kShown)) + (text.size() > kShown ? "…\"" : "\"");
}

// Empty unless `text` is an exact decimal int64.
std::optional<std::int64_t> parse_integer(std::string_view text) {
  const std::string_view digits = text.starts_with('-') ? text.substr(1) : text;
  if (digits.empty() || (digits.size() > 1 && digits.front() == '0')) return std::nullopt;
  return parse_number<std::int64_t>(text);
}

std::string_view kind_name(TreeNode::Kind kind) {
  switch (kind) {
    case TreeNode::Kind::null:
      return "nothing";
    case TreeNode::Kind::scalar:
      return "a single value";
    case TreeNode::Kind::sequence:
      return "a list";
    case TreeNode::Kind::map:
      return "a map";
  }
  return "";
}

}  // namespace

void Value::fail(std::string_view message) const {
  std::string text = entry_.empty() ? std::string() : "entry " + in_quotes(entry_) + ": ";
  fail_at(file_, node_->line, text += message);
}

Value Value::of_entry(std::string_view entry) const {
  Value value = *this;
  value.entry_ = entry;
  return value;
}

const std::string& Value::text(std::string_view what) const {
  if (node_->kind != TreeNode::Kind::scalar) {
    fail(in_quotes(what) + " is " + std::string(kind_name(node_->kind)) + "; write a single value");
  }
  if (std::ranges::any_of(node_->text, is_control)) {
    fail(in_quotes(what) + " holds a line break or control character; write plain text");
  }
  return node_->text;
}

std::vector<Value> Value::items(std::string_view what) const {
  if (node_->kind != TreeNode::Kind::sequence) {
    fail(in_quotes(what) + " is " + std::string(kind_name(node_->kind)) + "; write a list");
  }
  std::vector<Value> values;
  values.reserve(node_->items.size());
  for (const auto& item : node_->items)
    values.push_back(Value(*item, file_).of_entry(entry_));
  return values;
}

std::vector<std::pair<std::string, Value>> Value::fields(std::string_view what) const {
  if (node_->kind != TreeNode::Kind::map) {
    fail(in_quotes(what) + " is " + std::string(kind_name(node_->kind)) +
         "; write a map of \"key: value\" lines");
  }
  std::vector<std::pair<std::string, Value>> fields;
  std::set<std::string_view> seen;
  for (std::size_t i = 0; i + 1 < node_->items.size(); i += 2) {
    const Value key = Value(*node_->items[i], file_).of_entry(entry_);
    const std::string& name = key.text("key");
    if (!seen.insert(name).second)
      key.fail("key " + in_quotes(name) + " is written twice; remove one");
    fields.emplace_back(name, Value(*node_->items[i + 1], file_).of_entry(entry_));
  }
  return fields;
}

Value Value::key(std::string_view name) const {
  for (std::size_t i = 0; i + 1 < node_->items.size(); i += 2) {
    if (node_->items[i]->text == name) return {*node_->items[i], file_};
  }
  return *this;
}

std::int64_t Value::integer(std::string_view what, std::int64_t min, std::int64_t max) const {
  const auto value = parse_integer(text(what));
  if (value && *value >= min && *value <= max) return *value;
  std::string remedy =
      "; write a whole number from " + std::to_string(min) + " to " + std::to_string(max);
  if (!value) remedy += " in decimal digits (no fraction, exponent, unit or leading zero)";
  fail(in_quotes(what) + " is " + in_quotes(node_->text) + remedy);
}

std::int64_t Value::duration(std::string_view what, std::int64_t min, std::int64_t max) const {
  const auto& words = text(what);
  constexpr std::string_view kDigits = "0123456789";
  const bool has_leading_zero =
      words.size() > 1 && words[0] == '0' && kDigits.find(words[1]) != std::string_view::npos;
  auto value = parse_integer(words);
  if (!value && !has_leading_zero) value = parse_duration(words);
  if (value && *value >= min && *value <= max) return *value;
  std::string remedy = "; write a whole number from " + std::to_string(min) + " to " +
                       std::to_string(max) + " of nanoseconds";
  if (!value) {
    remedy +=
        " in decimal digits (no exponent or leading zero), or with a unit, as in 250ns, 1.5us, 5ms, "
        "1s";
  }
  fail(in_quotes(what) + " is " + in_quotes(node_->text) + remedy);
}

std::shared_ptr<const TreeNode> parse(std::string_view text, std::string_view file,
                                      std::string_view example) {
  check_is_text(text, file);
  // yaml-cpp takes a quoted text that the file's end cuts off as complete if a line break precedes
  // the end, so it does not get to see that.
  text = text.substr(0, text.find_last_not_of(" \t\r\n") + 1);
  std::istringstream stream{std::string(text)};
  try {
    YAML::Parser parser(stream);
    TreeBuilder first(file);
    if (!parser.HandleNextDocument(first))
      fail_at(file, 1, "empty; write at least one section, as in " + std::string(example));
    TreeBuilder second(file);
    if (parser.HandleNextDocument(second)) {
      fail_at(file, second.take_root()->line, "a second document begins; keep one per file");
    }
    return first.take_root();
  } catch (const YAML::Exception& error) {
    // The parser says where it gave up, which is not always where the mistake is.
    fail_at(file, line_of(error.mark),
            "not YAML: " + error.msg + "; check the indentation and brackets");
  }
}

std::string read_file(const std::filesystem::path& file) {
  try {
    return cie::read_file(file, kMaxBytes + 1);
  } catch (const std::system_error& error) {
    throw SpecError(file.string() + ": cannot read it: " + error.what());
  }
}

}  // namespace cie::yaml
