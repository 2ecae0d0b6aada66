#include "metadata_parser.hpp"

#include "fragment_parser.hpp"
#include "metadata_file.hpp"
#include "type_parser.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <set>
#include <utility>

namespace cie::analysis::ctf {
namespace {

// Metadata's text and what stands there.
class Text final : public TypeReader {
 public:
  explicit Text(std::string text) : text_(std::move(text)) {}

  TypeRef read(std::string_view type) override {
    types.leave_all();
    tokens.go_to(type);
    return types.type();
  }

 private:
  std::string text_;

 public:
  Tokens tokens{text_};
  TypeParser types{tokens};
};

class MetadataParser {
 public:
  MetadataParser(std::string text, const std::function<bool(std::string_view)>& is_wanted)
      : text_(std::make_shared<Text>(std::move(text))), is_wanted_(is_wanted) {}

  Metadata parse() {
    while (tokens_.peek().kind != Token::Kind::end)
      statement();
    check();
    if (has_unread_) metadata_.reader = text_;
    return std::move(metadata_);
  }

 private:
  auto no_types() {
    return [this](const std::string&, const TypeRef&) { tokens_.fail("expected no type here"); };
  }

  void statement() {
    if (tokens_.accept(";")) return;
    if (has_unread_ && is_declaration()) read_all();
    if (types_.accept_declaration()) return;
    if (tokens_.accept("trace")) {
      trace();
    } else if (tokens_.accept("env")) {
      environment();
    } else if (tokens_.accept("clock")) {
      clock();
    } else if (tokens_.accept("stream")) {
      stream();
    } else if (tokens_.accept("event")) {
      event();
    } else if (tokens_.accept("callsite")) {
      block([](const std::string&, const AttributeValue&) {}, no_types());
    } else if (is_declaration()) {
      types_.type();
    } else {
      tokens_.fail("expected a block or a type");
    }
  }

  bool is_declaration() const {
    constexpr std::array<std::string_view, 5> kKeywords{"typealias", "typedef", "struct", "variant",
                                                        "enum"};
    return std::ranges::any_of(
        kKeywords, [this](std::string_view keyword) { return tokens_.peek().is(keyword); });
  }

  // What comes has names that were not known where they stand.
  void read_all() {
    for (auto& event : metadata_.events)
      read_now(event);
    has_unread_ = false;
  }

  void read_now(EventClass& event) {
    if (event.unread_fields.empty()) return;
    const auto here = tokens_;
    try {
      event.fields = text_->read(std::exchange(event.unread_fields, {}));
    } catch (const MetadataError& error) {
      event.malformed = error.what();
    }
    tokens_ = here;
  }

  // Of an event's class. What cannot be understood is stepped over: the rest of the metadata can.
  void read_type(const std::string& name, EventClass& event) {
    const auto here = tokens_;
    const auto depth = types_.depth();
    try {
      auto type = types_.type();
      if (type->kind != Type::Kind::structure) tokens_.fail("expected a structure before this");
      if (!tokens_.peek().is(";") && !tokens_.peek().is("}")) tokens_.expect(";");
      if (name == "context") {
        event.context = std::move(type);
      } else if (name == "fields") {
        event.fields = std::move(type);
      }
    } catch (const MetadataError& error) {
      event.malformed = error.what();
      types_.leave_to(depth);
      tokens_ = here;
      if (!skip_type()) throw;
    }
  }

  // To the end of what a name stands for. False: there is none.
  bool skip_type() {
    std::size_t depth = 0;
    while (depth > 0 || !(tokens_.peek().is(";") || tokens_.peek().is("}"))) {
      if (tokens_.peek().kind == Token::Kind::end) return false;
      if (tokens_.peek().is("{")) ++depth;
      if (tokens_.peek().is("}")) --depth;
      tokens_.take();
    }
    return true;
  }

  // Leaves a structure unread if it may be read alone.
  std::string_view accept_unread() {
    const auto text = types_.has_own_names() ? std::string_view{} : tokens_.plain_structure();
    if (text.empty()) return {};
    const auto here = tokens_;
    tokens_.skip(text);
    if (tokens_.peek().is(";")) return text;
    tokens_ = here;  // an alignment follows, or what does not belong there
    return {};
  }

  // "{ name = value; name := type; … };"; what `leave_unread(name)` accepts is no type any more.
  template <typename OnAttribute, typename OnType, typename LeaveUnread>
  void block(OnAttribute&& on_attribute, OnType&& on_type, LeaveUnread&& leave_unread) {
    tokens_.expect("{");
    types_.enter();
    while (!tokens_.accept("}")) {
      if (tokens_.accept(";") || types_.accept_declaration()) continue;
      if (tokens_.peek().is("struct") || tokens_.peek().is("enum") ||
          tokens_.peek().is("variant")) {
        types_.type();
        continue;
      }
      // Names of the environment may be texts.
      const auto name = tokens_.peek().kind == Token::Kind::text ? unescape(tokens_.take().spelling)
                                                                 : types_.dotted_name();
      if (tokens_.accept(":=")) {
        if (!leave_unread(name)) {
          auto type = types_.type();
          if (type->kind != Type::Kind::structure) tokens_.fail("expected a structure before this");
          on_type(name, std::move(type));
        }
      } else {
        tokens_.expect("=");
        on_attribute(name, types_.value());
      }
      if (!tokens_.peek().is("}")) tokens_.expect(";");
    }
    types_.leave();
  }

  template <typename OnAttribute, typename OnType>
  void block(OnAttribute&& on_attribute, OnType&& on_type) {
    block(on_attribute, on_type, [](const std::string& /*name*/) { return false; });
  }

  void trace() {
    block(
        [this](const std::string& name, const AttributeValue& value) {
          if (name == "major" && value.number != 1) {
            tokens_.fail("only CTF 1 is understood; another major version ends here");
          }
          if (name == "byte_order") {
            if (value.text != "le" && value.text != "be" && value.text != "network") {
              tokens_.fail("unknown byte order");
            }
            metadata_.byte_order = value.text == "le" ? ByteOrder::little : ByteOrder::big;
          }
          if (name == "uuid") {
            metadata_.uuid = value.text;
            for (auto& c : metadata_.uuid) {
              if (c >= 'A' && c <= 'F') c = static_cast<char>(c - 'A' + 'a');
            }
          }
        },
        [this](const std::string& name, TypeRef type) {
          if (name == "packet.header") metadata_.packet_header = std::move(type);
        });
    has_trace_ = true;
  }

  void environment() {
    block([this](const std::string& name,
                 const AttributeValue& value) { metadata_.environment[name] = value.text; },
          no_types());
  }

  void clock() {
    Clock clock;
    block(
        [this, &clock](const std::string& name, const AttributeValue& value) {
          if (name == "name") clock.name = value.text;
          if (name == "description") clock.description = value.text;
          if (name == "uuid") clock.uuid = value.text;
          if (name == "freq") {
            if (value.number == 0) throw MetadataError("a clock must advance: its freq is 0");
            clock.frequency = value.number;
          }
          if (name == "offset_s") clock.offset_s = static_cast<std::int64_t>(value.number);
          if (name == "offset") clock.offset = static_cast<std::int64_t>(value.number);
        },
        no_types());
    metadata_.clocks.push_back(std::move(clock));
  }

  void stream() {
    StreamClass stream;
    block(
        [&stream](const std::string& name, const AttributeValue& value) {
          if (name == "id") stream.id = value.number;
        },
        [&stream](const std::string& name, TypeRef type) {
          if (name == "packet.context") {
            stream.packet_context = std::move(type);
          } else if (name == "event.header") {
            stream.event_header = std::move(type);
          } else if (name == "event.context") {
            stream.event_context = std::move(type);
          }
        });
    const auto id = stream.id;
    if (!metadata_.streams.emplace(id, std::move(stream)).second) {
      tokens_.fail("a second stream " + std::to_string(id) + " ends here");
    }
  }

  void event() {
    EventClass event;
    block(
        [&event](const std::string& name, const AttributeValue& value) {
          if (name == "name") event.name = value.text;
          if (name == "id") event.id = value.number;
          if (name == "stream_id") event.stream = value.number;
        },
        [](const std::string& /*name*/, const TypeRef& /*type*/) {},
        [this, &event](const std::string& name) {
          const bool may_wait = name == "fields" && !event.name.empty() && !event.fields &&
                                event.unread_fields.empty() &&  // twice: the last ones count
                                is_wanted_ && !is_wanted_(event.name);
          if (may_wait) event.unread_fields = accept_unread();
          if (!may_wait || event.unread_fields.empty()) read_type(name, event);
          return true;
        });
    if (event.fields) event.unread_fields = {};
    if (event.context) read_now(event);
    has_unread_ = has_unread_ || !event.unread_fields.empty();
    if (!event_ids_.emplace(event.stream, event.id).second) {
      tokens_.fail("a second event " + std::to_string(event.id) + " of stream " +
                   std::to_string(event.stream) + " ends here");
    }
    metadata_.events.push_back(std::move(event));
  }

  void check() {
    if (!has_trace_) throw MetadataError("there is no trace block");
    if (metadata_.streams.empty()) metadata_.streams.emplace(0, StreamClass{});
    for (const auto& event : metadata_.events) {
      if (!metadata_.streams.contains(event.stream)) {
        throw MetadataError("event \"" + event.name.substr(0, 100) + "\" is of stream " +
                            std::to_string(event.stream) + ", which is not declared");
      }
    }
  }

  std::shared_ptr<Text> text_;
  const std::function<bool(std::string_view)>& is_wanted_;
  Tokens& tokens_ = text_->tokens;
  TypeParser& types_ = text_->types;
  Metadata metadata_;
  std::set<std::pair<std::uint64_t, std::uint64_t>> event_ids_;
  bool has_trace_ = false;
  bool has_unread_ = false;
};

}  // namespace

Metadata parse_metadata(std::string text, const std::function<bool(std::string_view)>& is_wanted) {
  if (is_text_sequence(text)) return parse_fragments(text);
  return MetadataParser(std::move(text), is_wanted).parse();
}

}  // namespace cie::analysis::ctf
