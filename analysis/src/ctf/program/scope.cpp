#include "scope.hpp"

#include "choices.hpp"
#include "ctf/metadata/tokens.hpp"
#include "ctf/metadata/type_limits.hpp"
#include "event_choice.hpp"
#include "program_writer.hpp"
#include "references.hpp"
#include "scope_names.hpp"
#include "wants.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace cie::analysis::ctf {

namespace {

constexpr std::string_view kThreadName = "procname";
constexpr std::array kHeaderRoles{Role::event_class, Role::time};

}  // namespace

class ScopeBuilder {
 public:
  // `choice` keeps what programs that show their fields call them; null: they do not.
  ScopeBuilder(Scope& scope, bool is_header, std::span<const Role> roles,
               EventChoice* choice = nullptr)
      : scope_(scope),
        is_header_(is_header),
        wants_(scope.context_.has_roles, is_header, roles),
        choice_(choice),
        references_(scope),
        out_(scope.context_, *scope.program_) {}

  void build(const TypeRef& type, std::span<const FieldRequest> requests) {
    out_.align(type->align);
    references_.enter(*scope_.names_);
    const auto wants = wants_.by_name(*type, requests);
    for (std::size_t i = 0; i < wants.size(); ++i) {
      const auto& member = type->members[i];
      field(*scope_.names_, member.name, *member.type, wants[i]);
    }
    references_.leave();
  }

 private:
  bool is_big(const Type& type) const {
    const auto order =
        type.byte_order == ByteOrder::native ? scope_.context_.byte_order : type.byte_order;
    return order == ByteOrder::big;
  }

  const LabelTable* label_table(const Type& type, std::span<const std::string_view> labels) {
    if (labels.empty()) return nullptr;
    out_.count(type.ranges.size());
    auto& tables = scope_.context_.labels;
    tables.push_back(std::make_unique<const LabelTable>(label_table_of(type, labels)));
    return tables.back().get();
  }

  void note_slots(const Want& want, const Type& type) {
    for (const auto wanted : want.slots) {
      auto& slots = scope_.slots_;
      const auto slot = static_cast<std::size_t>(wanted);
      if (slots.size() <= slot) slots.resize(slot + 1);
      slots[slot].is_filled = true;
      if (!type.clock.empty()) slots[slot].clock = type.clock;
    }
  }

  // Further slots of a value; the operation itself has the first one.
  static void add_slots(Op& op, const Want& want) {
    for (std::size_t i = 1; i < want.slots.size(); ++i)
      op.extracts.push_back({.slot = want.slots[i], .labels = op.labels});
  }

  // Null if nobody looks.
  const ShownField* shown(const Type& type) {
    return choice_ == nullptr ? nullptr : choice_->keep(shown_field(type, shown_name_));
  }

  void number(ScopeNames& names, const Type& type, const Want& want) {
    out_.align(type.align);
    note_slots(want, type);
    const auto* labels = want.slots.empty() ? nullptr : label_table(type, want.labels);
    const bool is_loadable =
        (type.size == 8 || type.size == 16 || type.size == 32 || type.size == 64) &&
        !type.is_reversed && type.kind != Type::Kind::boolean;
    if (out_.is_whole_byte() && is_loadable && choice_ == nullptr) {
      auto& block = out_.block();
      out_.note(names);
      names.offset = static_cast<std::uint32_t>(block.size);
      for (const auto slot : want.slots) {
        block.extracts.push_back({.offset = names.offset,
                                  .load = load_of(type, scope_.context_.byte_order),
                                  .bits = static_cast<std::uint8_t>(type.size),
                                  .slot = slot,
                                  .labels = labels});
      }
      block.size += type.size / 8;
    } else {
      auto& op = out_.emit({.code = Op::Code::integer,
                            .is_signed = type.is_signed,
                            .is_big_endian = is_big(type),
                            .is_boolean = type.kind == Type::Kind::boolean,
                            .is_reversed = type.is_reversed,
                            .slot = want.first(),
                            .size = type.size,
                            .labels = labels,
                            .shown = shown(type)});
      add_slots(op, want);
      out_.note(names);
    }
    out_.advance(type.size);
  }

  void leb128(ScopeNames& names, const Type& type, const Want& want) {
    out_.align(8);
    note_slots(want, type);
    const auto* labels = want.slots.empty() ? nullptr : label_table(type, want.labels);
    // A time in an event header is as many low bits of the clock as it has; nothing else goes by
    // its length.
    auto& op = out_.emit({.code = Op::Code::leb128,
                          .is_signed = type.is_signed,
                          .slot = want.first(),
                          .size = is_header_ ? 0U : 64U,
                          .count = 1,
                          .labels = labels,
                          .shown = shown(type)});
    add_slots(op, want);
    out_.note(names);
    out_.stand_at({.align = 8, .phase = 0});
  }

  void real(const Type& type) {
    out_.align(type.align);
    const auto* seen = shown(type);
    if (seen != nullptr && seen->kind == FieldValue::Kind::real) {
      out_.emit({.code = Op::Code::integer,
                 .is_big_endian = is_big(type),
                 .is_reversed = type.is_reversed,
                 .size = type.size,
                 .shown = seen});
    } else if (out_.is_whole_byte() && type.size % 8 == 0 && seen == nullptr) {
      out_.block().size += type.size / 8;
    } else {
      out_.emit({.code = Op::Code::packed,
                 .is_big_endian = is_big(type),
                 .size = type.size,
                 .stride = type.size,
                 .count = 1,
                 .shown = seen});
    }
    out_.advance(type.size);
  }

  void string(const Type& type, const Want& want) {
    out_.align(8);
    note_slots(want, type);
    out_.emit(
        {.code = Op::Code::text, .slot = want.first(), .size = type.size, .shown = shown(type)});
    out_.stand_at({.align = 8, .phase = 0});
  }

  void structure(ScopeNames& names, const Type& type) {
    out_.align(type.align);
    references_.enter(names);
    open(type);
    for (const auto& member : type.members)
      field(names, member.name, *member.type, {});
    close();
    references_.leave();
  }

  // What is shown from here on belongs to a field of that type.
  void open(const Type& type) {
    if (const auto* seen = shown(type)) out_.emit({.code = Op::Code::open, .shown = seen});
  }
  void close() {
    if (choice_ != nullptr) out_.emit({.code = Op::Code::close});
  }

  // Elements of known size and distance, so that they can be skipped at once.
  static bool is_plain(const Type& element) {
    return is_fixed_number(element) || element.kind == Type::Kind::real;
  }

  std::int16_t kept_length(const ScopeNames& names, const Type& type) {
    const auto found = references_.find(names, type);
    for (const auto* length : found) {
      const bool is_count = !length->type->is_signed && length->type->kind != Type::Kind::boolean &&
                            length->type->kind != Type::Kind::bits;
      if (!is_count) {
        throw MetadataError("the length \"" + length->name.substr(0, 100) +
                            "\" is signed, or no integer");
      }
    }
    return references_.keep(found);
  }

  void array(ScopeNames& names, const Type& type, Want want) {
    const auto& element = *type.element;
    Op op{.count = type.length};
    if (type.kind == Type::Kind::sequence) op.length = kept_length(names, type);
    out_.align(std::max(type.align, element.align));
    if (choice_ != nullptr) {
      shown_array(names, type, element, std::move(op));
    } else if (element.kind == Type::Kind::leb128) {
      note_slots(want, element);
      op.code = Op::Code::leb128;
      op.is_signed = element.is_signed;
      op.is_list = true;
      op.slot = want.first();
      out_.emit(std::move(op));
      out_.stand_at({.align = 8, .phase = 0});
    } else if (is_plain(element)) {
      if (!is_number(element)) want = {};
      packed(element, std::move(op), want);
    } else {
      loop(names, element, std::move(op));
    }
  }

  // The same where everybody looks: element by element, but for characters.
  void shown_array(ScopeNames& names, const Type& type, const Type& element, Op op) {
    if (element.is_text && is_plain(element) && element.size == 8 && out_.is_whole_byte()) {
      op.shown = choice_->keep(
          {.kind = type.is_wide_text ? FieldValue::Kind::opaque : FieldValue::Kind::text,
           .name = shown_name_});
      packed(element, std::move(op), {});
      return;
    }
    open(type);
    loop(names, element, std::move(op));
    close();
  }

  void packed(const Type& element, Op op, const Want& want) {
    op.stride = std::uint64_t{(element.size + element.align - 1) / element.align} * element.align;
    const bool is_text = element.is_text && element.size == 8 && out_.is_whole_byte();
    note_slots(want, element);
    std::uint64_t size = 0;
    if ((want.slots.empty() || is_text) && op.shown == nullptr && op.length < 0 &&
        out_.is_whole_byte() && op.stride == element.size &&
        !__builtin_mul_overflow(op.count, element.size, &size) && size % 8 == 0 &&
        size / 8 < kMaxBlock) {
      if (size == 0) return;
      auto& block = out_.block();
      for (const auto slot : want.slots) {
        block.extracts.push_back({.offset = static_cast<std::uint32_t>(block.size),
                                  .load = Load::text,
                                  .slot = slot,
                                  .length = static_cast<std::uint32_t>(op.count)});
      }
      block.size += size / 8;
      out_.advance(size);
      return;
    }
    op.code = Op::Code::packed;
    op.is_signed = element.is_signed;
    op.is_big_endian = is_big(element);
    op.is_text = is_text;
    op.is_boolean = element.kind == Type::Kind::boolean;
    op.is_reversed = element.is_reversed;
    op.slot = want.first();
    op.size = element.size;
    const auto stride = op.stride;
    out_.emit(std::move(op));
    const auto whole = stride == element.size ? element.align : element.size & -element.size;
    out_.stand_at({.align = std::min<std::uint64_t>(whole, out_.place().align), .phase = 0});
  }

  void loop(ScopeNames& names, const Type& element, Op op) {
    // Names inside an element are known inside it only.
    op.body = out_.body({}, [&] { field(names, "[]", element, {}, {}); });
    out_.stand_at({});
    if (op.body->ops.empty()) return;
    op.code = Op::Code::loop;
    out_.emit(std::move(op));
  }

  // One of several bodies that follow each other in no way.
  std::shared_ptr<const Sequence> option(ScopeNames& names, const NamedType& option,
                                         const Position& before, const std::string& called) {
    auto body = out_.body(before, [&] { field(names, option.name, *option.type, {}, called); });
    // What another option holds is not there when this one is: nobody may name it alone.
    names.members.back()->name.clear();
    return body;
  }

  // Ranges of the tag that select an option: its own, or those with its name as label.
  void variant(ScopeNames& names, const Type& type) {
    if (!type.location && type.reference.empty()) throw MetadataError("a variant without a tag");
    const auto tags = references_.find(names, type);
    const auto& tag = *tags.front()->type;
    if (!type.location && tag.kind != Type::Kind::enumeration) {
      throw MetadataError("the tag \"" + type.reference + "\" of a variant is no enumeration");
    }
    check_selectors(tags);
    Op op{.code = Op::Code::variant, .length = references_.keep(tags), .bias = bias_of(tag)};
    const auto called = shown_name_;
    const auto before = out_.place();
    std::optional<Position> after;
    references_.enter(names);
    std::vector<std::shared_ptr<const Sequence>> bodies;
    for (const auto& member : type.members) {
      bodies.push_back(option(names, member, before, called));
      after = after ? common(*after, out_.place()) : out_.place();
    }
    references_.leave();
    if (!type.location) add_labelled(op, type, tag, bodies, out_);
    out_.count(type.selections.size());
    add_selections(op, type, tag, bodies);
    out_.emit(std::move(op));
    out_.note(names);
    out_.stand_at(after.value_or(Position{}));
  }

  void optional(ScopeNames& names, const Type& type) {
    const auto tags = references_.find(names, type);
    const auto& tag = *tags.front()->type;
    check_selectors(tags);
    if (type.selections.empty() != (tag.kind == Type::Kind::boolean)) {
      throw MetadataError("the selector of the optional field \"" + names.name.substr(0, 100) +
                          "\" does not fit its ranges");
    }
    Op op{.code = Op::Code::variant,
          .is_optional = true,
          .length = references_.keep(tags),
          .bias = bias_of(tag)};
    const auto before = out_.place();
    references_.enter(names);
    const auto body = option(names, {.name = {}, .type = type.element}, before, shown_name_);
    references_.leave();
    if (type.selections.empty()) op.choices.push_back({.low = 1, .high = 1, .body = body});
    out_.count(type.selections.size());
    add_selections(op, type, tag, {body});
    const auto after = common(before, out_.place());
    out_.emit(std::move(op));
    out_.note(names);
    out_.stand_at(after);
  }

  void field(ScopeNames& parent, const std::string& name, const Type& type, const Want& want) {
    field(parent, name, type, want, std::string(wants_.requested_name(name)));
  }
  // Options are called as what they are options of, elements not at all.
  void field(ScopeNames& parent, const std::string& name, const Type& type, const Want& want,
             const std::string& shown_name) {
    out_.count(1);
    auto& names = parent.add(name, &type);
    names.is_open = true;
    shown_name_ = shown_name;
    value(names, type, wants_.of_field(names.name, type, want));
    names.is_open = false;
  }

  void value(ScopeNames& names, const Type& type, Want want) {
    if (type.is_wide_text && !want.slots.empty()) {
      if (names.name != kThreadName)
        throw MetadataError("the text \"" + names.name.substr(0, 100) + "\" is not in UTF-8");
      want = {};  // nothing but a name is lost
    }
    switch (type.kind) {
      case Type::Kind::integer:
      case Type::Kind::enumeration:
      case Type::Kind::boolean:
      case Type::Kind::bits:
        return number(names, type, want);
      case Type::Kind::leb128:
        return leb128(names, type, want);
      case Type::Kind::real:
        return real(type);
      case Type::Kind::string:
        return string(type, want);
      case Type::Kind::structure:
        return structure(names, type);
      case Type::Kind::variant:
        return variant(names, type);
      case Type::Kind::optional:
        return optional(names, type);
      case Type::Kind::array:
      case Type::Kind::sequence:
        return array(names, type, want);
    }
  }

  Scope& scope_;
  bool is_header_;
  Wants wants_;
  EventChoice* choice_;     // null: nothing is shown
  std::string shown_name_;  // of the field that is laid out
  References references_;
  ProgramWriter out_;
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

void Scope::build(const TypeRef& type, std::span<const FieldRequest> requests,
                  std::span<const Role> roles) {
  if (slots_.size() < requests.size()) slots_.resize(requests.size());
  if (type) ScopeBuilder(*this, false, roles).build(type, requests);
}

void Scope::build_shown(const TypeRef& type, std::span<const FieldRequest> requests,
                        EventChoice& choice) {
  slots_.resize(std::max(slots_.size(), requests.size()));
  if (!type) return;
  choice.keep(type);
  ScopeBuilder(*this, false, {}, &choice).build(type, requests);
}

void Scope::build_header(const TypeRef& type) {
  slots_.resize(kHeaderTime + 1);
  if (type) ScopeBuilder(*this, true, kHeaderRoles).build(type, {});
}

bool Scope::has_slot(std::size_t slot) const noexcept {
  return slot < slots_.size() && slots_[slot].is_filled;
}

}  // namespace cie::analysis::ctf
