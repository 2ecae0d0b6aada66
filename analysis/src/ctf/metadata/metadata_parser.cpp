#include "metadata_parser.hpp"

#include "fragment_parser.hpp"
#include "metadata_file.hpp"
#include "type_parser.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

namespace cie::analysis::ctf {
namespace {

class MetadataParser {
 public:
  explicit MetadataParser(std::string_view text) : tokens_(text), types_(tokens_) {}

  Metadata parse() {
    while (tokens_.peek().kind != Token::Kind::end)
      statement();
    check();
    return std::move(metadata_);
  }

 private:
  auto no_types() {
    return [this](const std::string&, const TypeRef&) { tokens_.fail("expected no type here"); };
  }

  void statement() {
    if (tokens_.accept(";") || types_.accept_declaration()) return;
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
    } else if (tokens_.peek().is("struct") || tokens_.peek().is("variant") ||
               tokens_.peek().is("enum")) {
      types_.type();
    } else {
      tokens_.fail("expected a block or a type");
    }
  }

  // "{ name = value; name := type; … };"
  template <typename OnAttribute, typename OnType>
  void block(OnAttribute&& on_attribute, OnType&& on_type) {
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
        auto type = types_.type();
        if (type->kind != Type::Kind::structure) tokens_.fail("expected a structure before this");
        on_type(name, std::move(type));
      } else {
        tokens_.expect("=");
        on_attribute(name, types_.value());
      }
      if (!tokens_.peek().is("}")) tokens_.expect(";");
    }
    types_.leave();
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
            if (value.number == 0) tokens_.fail("a clock must advance");
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
        [&event](const std::string& name, TypeRef type) {
          if (name == "context") {
            event.context = std::move(type);
          } else if (name == "fields") {
            event.fields = std::move(type);
          }
        });
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

  Tokens tokens_;
  TypeParser types_;
  Metadata metadata_;
  std::set<std::pair<std::uint64_t, std::uint64_t>> event_ids_;
  bool has_trace_ = false;
};

}  // namespace

Metadata parse_metadata(std::string_view text) {
  return is_text_sequence(text) ? parse_fragments(text) : MetadataParser(text).parse();
}

}  // namespace cie::analysis::ctf
