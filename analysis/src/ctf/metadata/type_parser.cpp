#include "type_parser.hpp"

#include "type_limits.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace cie::analysis::ctf {
namespace {

constexpr std::uint32_t kMaxRealBits = 128;

bool is_true(const AttributeValue& value) {
  return value.text == "true" || value.text == "TRUE" || (value.is_number && value.number != 0);
}

// "clock.NAME.value"
std::string clock_of(std::string_view path) {
  constexpr std::string_view kPrefix = "clock.";
  if (!path.starts_with(kPrefix)) return {};
  path.remove_prefix(kPrefix.size());
  return std::string(path.substr(0, path.find('.')));
}

bool is_hexadecimal(const AttributeValue& base) {
  constexpr std::array<std::string_view, 5> kNames{"hexadecimal", "hex", "x", "X", "p"};
  return base.is_number ? base.number == 16
                        : std::find(kNames.begin(), kNames.end(), base.text) != kNames.end();
}

std::uint32_t default_align(std::uint32_t size) { return size % 8 == 0 ? 8 : 1; }

}  // namespace

std::string TypeParser::dotted_name() {
  std::string name;
  for (;;) {
    if (tokens_.peek().kind != Token::Kind::name) tokens_.fail("expected a name");
    name += tokens_.take().spelling;
    if (!tokens_.accept(".") && !tokens_.accept("->")) return name;
    name += '.';
  }
}

AttributeValue TypeParser::value() {
  AttributeValue result;
  const auto kind = tokens_.peek().kind;
  if (kind == Token::Kind::text) {
    result.text = unescape(tokens_.take().spelling);
  } else if (kind == Token::Kind::name) {
    result.text = dotted_name();
  } else {
    const bool is_negative = tokens_.peek().is("-");
    result.number = constant();
    result.is_number = true;
    result.text = is_negative ? std::to_string(static_cast<std::int64_t>(result.number))
                              : std::to_string(result.number);
  }
  return result;
}

std::uint64_t TypeParser::constant() {
  bool is_negative = false;
  while (tokens_.peek().is("-") || tokens_.peek().is("+")) {
    is_negative ^= tokens_.take().is("-");
  }
  if (tokens_.peek().kind != Token::Kind::number) tokens_.fail("expected a number");
  const auto number = tokens_.take().number;
  return is_negative ? 0 - number : number;
}

std::uint32_t TypeParser::alignment(const AttributeValue& value) const {
  const auto align = value.number;
  if (!value.is_number || !is_alignment(align)) {
    tokens_.fail("an alignment must be a power of two up to 32768");
  }
  return static_cast<std::uint32_t>(align);
}

ByteOrder TypeParser::byte_order(const AttributeValue& value) const {
  if (value.text == "native") return ByteOrder::native;
  if (value.text == "le") return ByteOrder::little;
  if (value.text == "be" || value.text == "network") return ByteOrder::big;
  tokens_.fail("unknown byte order");
}

// "{ name = value; … }"
template <typename OnAttribute>
void TypeParser::attributes(OnAttribute&& on_attribute) {
  tokens_.expect("{");
  while (!tokens_.accept("}")) {
    if (tokens_.accept(";")) continue;
    const auto name = dotted_name();
    tokens_.expect("=");
    on_attribute(name, value());
    if (!tokens_.peek().is("}")) tokens_.expect(";");
  }
}

TypeRef TypeParser::finish(Type type) const {
  type.depth = depth_of(type);
  if (type.depth > kMaxNesting) tokens_.fail("types are nested too deeply");
  return std::make_shared<const Type>(std::move(type));
}

TypeRef TypeParser::integer() {
  const auto block = tokens_.block();
  if (const auto known = integers_.find(block); known != integers_.end()) {
    tokens_.skip(block);
    return known->second;
  }
  Type type{.kind = Type::Kind::integer};
  type.align = 0;
  attributes([&](const std::string& name, const AttributeValue& value) {
    if (name == "size") {
      if (!value.is_number || value.number == 0 || value.number > kMaxIntegerBits) {
        tokens_.fail("an integer must have 1 to 64 bits");
      }
      type.size = static_cast<std::uint32_t>(value.number);
    } else if (name == "align") {
      type.align = alignment(value);
    } else if (name == "signed") {
      type.is_signed = is_true(value);
    } else if (name == "byte_order") {
      type.byte_order = byte_order(value);
    } else if (name == "encoding") {
      type.is_text = !value.text.empty() && value.text != "none";
    } else if (name == "base") {
      type.is_hexadecimal = is_hexadecimal(value);
    } else if (name == "map") {
      type.clock = clock_of(value.text);
    }
  });
  if (type.size == 0) tokens_.fail("an integer without a size ends here");
  if (type.align == 0) type.align = default_align(type.size);
  auto result = finish(std::move(type));
  // In texts and comments a "}" is none.
  if (block.find_first_of("\"'/") == std::string_view::npos) integers_.emplace(block, result);
  return result;
}

TypeRef TypeParser::real() {
  Type type{.kind = Type::Kind::real};
  type.align = 0;
  std::uint64_t exponent = 0;
  std::uint64_t mantissa = 0;
  attributes([&](const std::string& name, const AttributeValue& value) {
    if (name == "exp_dig") exponent = value.number;
    if (name == "mant_dig") mantissa = value.number;
    if (name == "align") type.align = alignment(value);
    if (name == "byte_order") type.byte_order = byte_order(value);
  });
  if (exponent == 0 || mantissa == 0 || exponent > kMaxRealBits || mantissa > kMaxRealBits ||
      exponent + mantissa > kMaxRealBits) {
    tokens_.fail("a floating point type of no known size ends here");
  }
  type.size = static_cast<std::uint32_t>(exponent + mantissa);
  if (type.align == 0) type.align = default_align(type.size);
  return finish(std::move(type));
}

TypeRef TypeParser::string() {
  if (tokens_.peek().is("{")) attributes([](const std::string&, const AttributeValue&) {});
  if (!string_) {
    Type type{.kind = Type::Kind::string};
    type.align = 8;
    string_ = finish(std::move(type));
  }
  return string_;
}

void TypeParser::ranges(Type& type) {
  std::uint64_t next = 0;
  tokens_.expect("{");
  while (!tokens_.accept("}")) {
    const auto kind = tokens_.peek().kind;
    if (kind != Token::Kind::name && kind != Token::Kind::text) tokens_.fail("expected a label");
    const auto label = tokens_.take();
    EnumerationRange range{
        .label = kind == Token::Kind::text ? unescape(label.spelling) : std::string(label.spelling),
        .low = next,
        .high = next};
    if (tokens_.accept("=")) {
      range.low = constant();
      range.high = tokens_.accept("...") ? constant() : range.low;
    }
    next = range.high + 1;
    type.ranges.push_back(std::move(range));
    if (!tokens_.peek().is("}")) tokens_.expect(",");
  }
}

TypeRef TypeParser::enumeration() {
  std::string name;
  if (tokens_.peek().kind == Token::Kind::name) name = tokens_.take().spelling;
  TypeRef container;
  if (tokens_.accept(":")) container = specifier(false);
  if (!tokens_.peek().is("{")) {
    if (container || name.empty()) tokens_.fail("expected the labels of an enumeration");
    return named("enum ", name);
  }
  if (!container) container = named("", "int");
  if (container->kind != Type::Kind::integer) {
    tokens_.fail("an enumeration must be of an integer type");
  }
  Type type = *container;
  type.kind = Type::Kind::enumeration;
  ranges(type);
  auto result = finish(std::move(type));
  if (!name.empty()) declare("enum " + name, result);
  return result;
}

// Fields of a structure or options of a variant.
void TypeParser::members(Type& parent) {
  tokens_.expect("{");
  enter();
  while (!tokens_.accept("}")) {
    if (accept_declaration() || tokens_.accept(";")) continue;
    const auto type = specifier(true);
    do {
      auto member = declarator(type);
      if (parent.kind == Type::Kind::structure) {
        parent.align = std::max(parent.align, member.type->align);
      }
      parent.members.push_back(std::move(member));
    } while (tokens_.accept(","));
    tokens_.expect(";");
  }
  leave();
}

TypeRef TypeParser::structure() {
  std::string name;
  if (tokens_.peek().kind == Token::Kind::name && !tokens_.peek().is("align")) {
    name = tokens_.take().spelling;
  }
  if (!tokens_.peek().is("{")) {
    if (name.empty()) tokens_.fail("expected the fields of a structure");
    return named("struct ", name);
  }
  Type type{.kind = Type::Kind::structure};
  members(type);
  if (tokens_.accept("align")) {
    tokens_.expect("(");
    type.align = std::max(type.align, alignment(value()));
    tokens_.expect(")");
  }
  auto result = finish(std::move(type));
  if (!name.empty()) declare("struct " + name, result);
  return result;
}

TypeRef TypeParser::variant() {
  std::string name;
  std::string tag;
  if (tokens_.peek().kind == Token::Kind::name) name = tokens_.take().spelling;
  if (tokens_.accept("<")) {
    tag = dotted_name();
    tokens_.expect(">");
  }
  if (!tokens_.peek().is("{")) {
    if (name.empty()) tokens_.fail("expected the options of a variant");
    Type type = *named("variant ", name);
    if (!tag.empty()) type.reference = tag;
    return finish(std::move(type));
  }
  Type type{.kind = Type::Kind::variant};
  type.reference = tag;
  members(type);
  auto result = finish(std::move(type));
  if (!name.empty()) declare("variant " + name, result);
  return result;
}

TypeRef TypeParser::named(const char* keyword, const std::string& name) const {
  for (auto scope = scopes_.rbegin(); scope != scopes_.rend(); ++scope) {
    const auto found = scope->find(keyword + name);
    if (found != scope->end()) return found->second;
  }
  tokens_.fail("unknown type \"" + (keyword + name).substr(0, 100) + "\" before this");
}

void TypeParser::declare(const std::string& name, TypeRef type) {
  scopes_.back()[name] = std::move(type);
}

// "unsigned long", "uint8_t": names as an alias spells them.
TypeRef TypeParser::alias(bool is_before_declarator) {
  std::string name;
  while (tokens_.peek().kind == Token::Kind::name || (!name.empty() && tokens_.peek().is("*"))) {
    const auto& after = tokens_.peek_next();
    const bool is_last = after.kind != Token::Kind::name && !after.is("*");
    if (is_before_declarator && !name.empty() && is_last) break;
    if (!name.empty()) name += ' ';
    name += tokens_.take().spelling;
    if (is_last && !is_before_declarator) break;
  }
  if (name.empty()) tokens_.fail("expected a type");
  return named("", name);
}

TypeRef TypeParser::specifier(bool is_before_declarator) {
  if (++nesting_ > kMaxNesting) tokens_.fail("types are nested too deeply");
  while (tokens_.accept("const")) {
  }
  TypeRef result;
  if (tokens_.accept("integer")) {
    result = integer();
  } else if (tokens_.accept("floating_point")) {
    result = real();
  } else if (tokens_.accept("string")) {
    result = string();
  } else if (tokens_.accept("enum")) {
    result = enumeration();
  } else if (tokens_.accept("struct")) {
    result = structure();
  } else if (tokens_.accept("variant")) {
    result = variant();
  } else {
    result = alias(is_before_declarator);
  }
  --nesting_;
  return result;
}

TypeRef TypeParser::type() { return specifier(false); }

// "name", "name[3]", "name[length][2]"
NamedType TypeParser::declarator(TypeRef type) {
  while (tokens_.accept("*")) {
  }
  if (tokens_.peek().kind != Token::Kind::name) tokens_.fail("expected the name of a field");
  NamedType result{.name = std::string(tokens_.take().spelling), .type = {}};
  std::vector<Type> dimensions;
  while (tokens_.accept("[")) {
    Type dimension{.kind = Type::Kind::array};
    if (tokens_.peek().kind == Token::Kind::number) {
      dimension.length = constant();
    } else {
      dimension.kind = Type::Kind::sequence;
      dimension.reference = dotted_name();
    }
    tokens_.expect("]");
    dimensions.push_back(std::move(dimension));
    if (dimensions.size() > kMaxNesting) tokens_.fail("types are nested too deeply");
  }
  // The last pair of brackets is the innermost array.
  for (auto dimension = dimensions.rbegin(); dimension != dimensions.rend(); ++dimension) {
    dimension->align = type->align;
    dimension->element = type;
    type = finish(std::move(*dimension));
  }
  result.type = std::move(type);
  return result;
}

bool TypeParser::accept_declaration() {
  if (tokens_.accept("typealias")) {
    auto type = specifier(false);
    tokens_.expect(":=");
    std::string name;
    while (tokens_.peek().kind == Token::Kind::name || tokens_.peek().is("*")) {
      if (!name.empty()) name += ' ';
      name += tokens_.take().spelling;
    }
    if (name.empty()) tokens_.fail("expected the name of an alias");
    tokens_.expect(";");
    declare(name, std::move(type));
    return true;
  }
  if (tokens_.accept("typedef")) {
    const auto type = specifier(true);
    do {
      auto alias = declarator(type);
      declare(alias.name, std::move(alias.type));
    } while (tokens_.accept(","));
    tokens_.expect(";");
    return true;
  }
  return false;
}

}  // namespace cie::analysis::ctf
