#include "program_builder.hpp"

#include "scope_names.hpp"
#include "tokens.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace cie::analysis::ctf {

namespace {

constexpr std::size_t kMaxFields = 500'000;
constexpr std::uint64_t kMaxBlock = 1U << 20U;  // bytes
constexpr std::size_t kHeaderId = 0;
constexpr std::size_t kHeaderTime = 1;
constexpr std::array<std::string_view, 6> kRoots{"trace.packet.header", "stream.packet.context",
                                                 "stream.event.header", "stream.event.context",
                                                 "event.context",       "event.fields"};

std::uint64_t bias_of(const Type& type) { return type.is_signed ? std::uint64_t{1} << 63U : 0; }

Load load_of(std::uint32_t size, bool is_signed, bool is_big) {
  switch (size) {
    case 8:
      return is_signed ? Load::i8 : Load::u8;
    case 16:
      if (is_big) return is_signed ? Load::i16be : Load::u16be;
      return is_signed ? Load::i16 : Load::u16;
    case 32:
      if (is_big) return is_signed ? Load::i32be : Load::u32be;
      return is_signed ? Load::i32 : Load::u32;
    default:
      return is_big ? Load::u64be : Load::u64;
  }
}

bool is_number(const Type& type) {
  return type.kind == Type::Kind::integer || type.kind == Type::Kind::enumeration;
}

// TSDL marks names that its tracer did not choose with an underscore.
std::string_view plain(std::string_view name) {
  return name.starts_with('_') ? name.substr(1) : name;
}

}  // namespace

class ScopeBuilder {
 public:
  explicit ScopeBuilder(Scope& scope, bool is_header) : scope_(scope), is_header_(is_header) {}

  void build(const TypeRef& type, std::span<const FieldRequest> requests) {
    sequence_ = scope_.program_.get();
    align(type->align);
    frames_.push_back(scope_.names_.get());
    std::vector<std::size_t> chosen(requests.size(), SIZE_MAX);
    std::vector<const NamedType*> winners(requests.size(), nullptr);
    for (const auto& member : type->members) {
      for (std::size_t slot = 0; slot < requests.size(); ++slot) {
        const auto alternative = requests[slot].alternative(plain(member.name));
        if (!alternative || *alternative >= chosen[slot]) continue;
        chosen[slot] = *alternative;
        winners[slot] = &member;
      }
    }
    for (const auto& member : type->members) {
      Want want;
      for (std::size_t slot = 0; slot < requests.size(); ++slot) {
        // Two requests for one member: the later slot would stay empty, so no table asks twice.
        if (winners[slot] == &member) {
          want = {.slot = static_cast<std::int16_t>(slot), .labels = requests[slot].labels};
          break;
        }
      }
      field(member.name, *member.type, want);
    }
    frames_.pop_back();
  }

 private:
  struct Want {
    std::int16_t slot = kNone;
    std::span<const std::string_view> labels{};
  };
  // What is known of the position: a multiple of `align` bits plus `phase`.
  struct Place {
    std::uint64_t align = 1;
    std::uint64_t phase = 0;
  };

  Op& emit(Op op) {
    count_one();
    is_block_open_ = false;
    sequence_->ops.push_back(std::move(op));
    return sequence_->ops.back();
  }

  bool is_whole_byte() const { return place_.align >= 8 && place_.phase % 8 == 0; }
  void advance(std::uint64_t bits) { place_.phase = (place_.phase + bits) & (place_.align - 1); }

  void align(std::uint64_t to) {
    if (to <= 1) return;
    if (to > place_.align) {
      emit({.code = Op::Code::align, .size = to});
      place_ = {.align = to, .phase = 0};
      return;
    }
    const auto padding = (0 - place_.phase) & (to - 1);
    if (padding == 0) return;
    if (is_block_open_ && padding % 8 == 0) {
      sequence_->ops.back().size += padding / 8;
    } else {
      emit({.code = Op::Code::align, .size = to});
    }
    advance(padding);
  }

  bool is_big(const Type& type) const {
    const auto order =
        type.byte_order == ByteOrder::native ? scope_.context_.byte_order : type.byte_order;
    return order == ByteOrder::big;
  }

  const LabelTable* label_table(const Type& type, std::span<const std::string_view> labels) {
    if (labels.empty()) return nullptr;
    const auto bias = type.kind == Type::Kind::enumeration ? bias_of(type) : 0;
    std::vector<LabelTable::Range> ranges;
    if (type.kind == Type::Kind::enumeration) {
      for (const auto& range : type.ranges) {
        const auto found = std::find(labels.begin(), labels.end(), range.label);
        ranges.push_back({.low = range.low ^ bias,
                          .high = range.high ^ bias,
                          .label = found == labels.end()
                                       ? kNone
                                       : static_cast<std::int16_t>(found - labels.begin())});
      }
    } else {  // a plain integer goes by number
      for (std::size_t i = 0; i < labels.size(); ++i) {
        ranges.push_back({.low = i, .high = i, .label = static_cast<std::int16_t>(i)});
      }
    }
    auto& tables = scope_.context_.labels;
    tables.push_back(std::make_unique<const LabelTable>(std::move(ranges), bias));
    return tables.back().get();
  }

  // A block that the next field of whole bytes can join.
  Op& open_block() {
    if (!is_block_open_ || sequence_->ops.back().size > kMaxBlock) {
      emit({.code = Op::Code::block});
      is_block_open_ = true;
    }
    return sequence_->ops.back();
  }

  void note_slot(const Want& want, const Type& type) {
    if (want.slot < 0) return;
    auto& slots = scope_.slots_;
    const auto slot = static_cast<std::size_t>(want.slot);
    if (slots.size() <= slot) slots.resize(slot + 1);
    slots[slot].is_filled = true;
    if (!type.clock.empty()) slots[slot].clock = type.clock;
  }

  // In an event header values are found by meaning, at any depth.
  Want header_want(const std::string& name, const Type& type) const {
    if (!type.clock.empty() || name == "timestamp") return {.slot = kHeaderTime};
    if (name == "id") return {.slot = kHeaderId};
    return {};
  }

  void number(ScopeNames& names, const Type& type, Want want) {
    if (is_header_) want = header_want(names.name, type);
    align(type.align);
    note_slot(want, type);
    const auto* labels = want.slot >= 0 ? label_table(type, want.labels) : nullptr;
    names.sequence = sequence_;
    const bool is_loadable =
        type.size == 8 || type.size == 16 || type.size == 32 || type.size == 64;
    if (is_whole_byte() && is_loadable) {
      auto& block = open_block();
      names.op = sequence_->ops.size() - 1;
      names.offset = static_cast<std::uint32_t>(block.size);
      if (want.slot >= 0) {
        block.extracts.push_back({.offset = names.offset,
                                  .load = load_of(type.size, type.is_signed, is_big(type)),
                                  .bits = static_cast<std::uint8_t>(type.size),
                                  .slot = want.slot,
                                  .labels = labels});
      }
      block.size += type.size / 8;
    } else {
      emit({.code = Op::Code::integer,
            .is_signed = type.is_signed,
            .is_big_endian = is_big(type),
            .slot = want.slot,
            .size = type.size,
            .labels = labels});
      names.op = sequence_->ops.size() - 1;
    }
    advance(type.size);
  }

  void real(const Type& type) {
    align(type.align);
    if (is_whole_byte() && type.size % 8 == 0) {
      open_block().size += type.size / 8;
    } else {
      emit({.code = Op::Code::packed, .size = type.size, .stride = type.size, .count = 1});
    }
    advance(type.size);
  }

  void string(const Type& type, const Want& want) {
    align(8);
    note_slot(want, type);
    emit({.code = Op::Code::text, .slot = want.slot});
    place_ = {.align = 8, .phase = 0};
  }

  void structure(ScopeNames& names, const Type& type) {
    align(type.align);
    frames_.push_back(&names);
    for (const auto& member : type.members)
      field(member.name, *member.type, {});
    frames_.pop_back();
  }

  // Elements of known size and distance, so that they can be skipped at once.
  static bool is_plain(const Type& element) {
    return is_number(element) || element.kind == Type::Kind::real;
  }

  void array(const Type& type, Want want) {
    const auto& element = *type.element;
    Op op{.count = type.length};
    if (type.kind == Type::Kind::sequence) {
      auto* length = resolve(type.reference);
      if (length->type->is_signed) {
        throw MetadataError("the length \"" + type.reference.substr(0, 100) + "\" is signed");
      }
      op.length = keep(length);
    }
    align(element.align);
    if (is_plain(element)) {
      op.stride = std::uint64_t{(element.size + element.align - 1) / element.align} * element.align;
      if (!is_number(element)) want = {};
      const bool is_text = element.is_text && element.size == 8 && is_whole_byte();
      note_slot(want, element);
      std::uint64_t size = 0;
      if ((want.slot < 0 || is_text) && op.length < 0 && is_whole_byte() &&
          op.stride == element.size && !__builtin_mul_overflow(op.count, element.size, &size) &&
          size % 8 == 0 && size / 8 < kMaxBlock) {
        if (size == 0) return;
        auto& block = open_block();
        if (want.slot >= 0) {
          block.extracts.push_back({.offset = static_cast<std::uint32_t>(block.size),
                                    .load = Load::text,
                                    .slot = want.slot,
                                    .length = static_cast<std::uint32_t>(op.count)});
        }
        block.size += size / 8;
        advance(size);
        return;
      }
      op.code = Op::Code::packed;
      op.is_signed = element.is_signed;
      op.is_big_endian = is_big(element);
      op.is_text = is_text;
      op.slot = want.slot;
      op.size = element.size;
      const auto stride = op.stride;
      emit(std::move(op));
      const auto whole = stride == element.size ? element.align : element.size & -element.size;
      place_ = {.align = std::min<std::uint64_t>(whole, place_.align), .phase = 0};
      return;
    }
    const auto body = std::make_shared<Sequence>();
    scope_.context_.bodies.push_back(body);
    const auto outer = std::exchange(sequence_, body.get());
    place_ = {};
    is_block_open_ = false;
    ScopeNames of_element;
    of_element.name = "[]";
    // Names inside an element are known inside it only.
    frames_.back()->members.push_back(std::make_unique<ScopeNames>(std::move(of_element)));
    auto& names = *frames_.back()->members.back();
    value(names, element, {});
    sequence_ = outer;
    place_ = {};
    is_block_open_ = false;
    if (body->ops.empty()) return;
    op.code = Op::Code::loop;
    op.body = body;
    emit(std::move(op));
  }

  // Ranges of the tag that select an option: those with its name as label.
  void variant(ScopeNames& names, const Type& type) {
    if (type.reference.empty()) throw MetadataError("a variant without a tag");
    auto* tag = resolve(type.reference);
    if (tag->type->kind != Type::Kind::enumeration) {
      throw MetadataError("the tag \"" + type.reference + "\" of a variant is no enumeration");
    }
    Op op{.code = Op::Code::variant, .length = keep(tag), .bias = bias_of(*tag->type)};
    const auto before = place_;
    std::optional<Place> after;
    const auto outer = sequence_;
    frames_.push_back(&names);
    for (const auto& option : type.members) {
      const auto body = std::make_shared<Sequence>();
      sequence_ = body.get();
      place_ = before;
      is_block_open_ = false;
      field(option.name, *option.type, {});
      // What another option holds is not there when this one is: nobody may refer to it.
      names.members.back()->name.clear();
      scope_.context_.bodies.push_back(body);
      after = after ? common(*after, place_) : place_;
      for (const auto& range : tag->type->ranges) {
        if (plain(range.label) != plain(option.name)) continue;
        op.choices.push_back(
            {.low = range.low ^ op.bias, .high = range.high ^ op.bias, .body = body});
      }
    }
    frames_.pop_back();
    sequence_ = outer;
    emit(std::move(op));
    place_ = after.value_or(Place{});
  }

  static Place common(Place a, Place b) {
    Place both{.align = std::min(a.align, b.align), .phase = 0};
    while (((a.phase ^ b.phase) & (both.align - 1)) != 0)
      both.align /= 2;
    both.phase = a.phase & (both.align - 1);
    return both;
  }

  // Shared types multiply when they are laid out flat.
  void count_one() {
    if (++scope_.context_.fields > kMaxFields) {
      throw MetadataError("the types have more fields than any honest tracer writes");
    }
  }

  void field(const std::string& name, const Type& type, const Want& want) {
    count_one();
    auto& parent = *frames_.back();
    parent.members.push_back(std::make_unique<ScopeNames>());
    auto& names = *parent.members.back();
    names.name = name;
    value(names, type, want);
  }

  void value(ScopeNames& names, const Type& type, const Want& want) {
    names.type = &type;
    switch (type.kind) {
      case Type::Kind::integer:
      case Type::Kind::enumeration:
        return number(names, type, want);
      case Type::Kind::real:
        return real(type);
      case Type::Kind::string:
        return string(type, want);
      case Type::Kind::structure:
        return structure(names, type);
      case Type::Kind::variant:
        return variant(names, type);
      case Type::Kind::array:
      case Type::Kind::sequence:
        return array(type, want);
    }
  }

  // The integer that a reference names: absolute, or near it, or in an earlier scope.
  ScopeNames* resolve(const std::string& reference) {
    const std::string_view path = reference;
    auto* found = resolve_absolute(path);
    for (auto frame = frames_.rbegin(); found == nullptr && frame != frames_.rend(); ++frame) {
      found = walk(*frame, path);
    }
    for (auto earlier = scope_.earlier_.rbegin();
         found == nullptr && earlier != scope_.earlier_.rend(); ++earlier) {
      found = walk((*earlier)->names_.get(), path);
    }
    if (found == nullptr || found->type == nullptr || !is_number(*found->type) ||
        found->sequence == nullptr) {
      throw MetadataError("\"" + reference.substr(0, 100) +
                          "\", the length or tag of a field, is no integer before it");
    }
    return found;
  }

  ScopeNames* resolve_absolute(std::string_view path) {
    for (const auto root : kRoots) {
      if (!path.starts_with(root) || path.size() <= root.size() || path[root.size()] != '.') {
        continue;
      }
      path.remove_prefix(root.size() + 1);
      if (root == scope_.root_) return walk(scope_.names_.get(), path);
      for (auto* earlier : scope_.earlier_) {
        if (earlier->root_ == root) return walk(earlier->names_.get(), path);
      }
      return nullptr;
    }
    return nullptr;
  }

  // The register that keeps a value; reading it becomes part of its scope's program.
  std::int16_t keep(ScopeNames* names) {
    if (names->reg >= 0) return names->reg;
    auto& registers = registers_of(names);
    if (registers.next >= registers.end) {
      throw MetadataError("too many lengths and tags in one scope");
    }
    names->reg = registers.next++;
    auto& op = names->sequence->ops[names->op];
    const auto& type = *names->type;
    if (op.code == Op::Code::block) {
      op.extracts.push_back({.offset = names->offset,
                             .load = load_of(type.size, type.is_signed, is_big(type)),
                             .bits = static_cast<std::uint8_t>(type.size),
                             .reg = names->reg});
    } else {
      op.reg = names->reg;
    }
    return names->reg;
  }

  RegisterRange& registers_of(const ScopeNames* names) {
    for (auto* earlier : scope_.earlier_) {
      if (contains(*earlier->names_, names)) return earlier->registers_;
    }
    return scope_.registers_;
  }
  static bool contains(const ScopeNames& tree, const ScopeNames* names) {
    return std::any_of(tree.members.begin(), tree.members.end(), [names](const auto& member) {
      return member.get() == names || contains(*member, names);
    });
  }

  Scope& scope_;
  bool is_header_;
  Sequence* sequence_ = nullptr;
  std::vector<ScopeNames*> frames_;
  Place place_;
  bool is_block_open_ = false;
};

Scope::Scope(std::string_view root, BuildContext& context, RegisterRange& registers,
             std::vector<Scope*> earlier)
    : root_(root),
      context_(context),
      registers_(registers),
      earlier_(std::move(earlier)),
      program_(std::make_shared<Sequence>()),
      names_(std::make_unique<ScopeNames>()) {}

Scope::~Scope() = default;

void Scope::build(const TypeRef& type, std::span<const FieldRequest> requests) {
  if (slots_.size() < requests.size()) slots_.resize(requests.size());
  if (type) ScopeBuilder(*this, false).build(type, requests);
}

void Scope::build_header(const TypeRef& type) {
  slots_.resize(kHeaderTime + 1);
  if (type) ScopeBuilder(*this, true).build(type, {});
}

bool Scope::has_slot(std::size_t slot) const noexcept {
  return slot < slots_.size() && slots_[slot].is_filled;
}

}  // namespace cie::analysis::ctf
