// The fields of an event, read from bytes laid out by hand.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <ctf/program/scope.hpp>

namespace cie::analysis::ctf::test {

using Bytes = std::vector<std::uint8_t>;

struct Decoded {
  Bytes bytes;  // texts are views of it
  Outcome outcome = Outcome::ok;
  std::uint64_t end = 0;  // bits
  std::array<Field, kMaxSlots> fields{};
  std::vector<std::uint32_t> elements;

  bool has(std::size_t slot) const { return fields[slot].kind != Field::Kind::absent; }
  std::int64_t number(std::size_t slot) const { return fields[slot].number; }
  std::string text(std::size_t slot) const {
    return std::string(Payload{fields.data()}.text(slot));
  }
  std::vector<std::uint32_t> integers(std::size_t slot) const {
    const auto view = Payload{fields.data()}.integers(slot);
    return {view.begin(), view.end()};
  }
};

// The fields of the metadata's first event, from the first byte on.
class FieldsOf {
 public:
  FieldsOf(Metadata metadata, std::vector<FieldRequest> requests)
      : requests_(std::move(requests)),
        metadata_(std::move(metadata)),
        scope_("event.fields", context_, registers_, {}) {
    context_.byte_order = metadata_.byte_order;
    context_.has_roles = metadata_.has_roles;
    scope_.build(metadata_.events.at(0).fields, requests_);
  }

  // Several events one after the other keep what earlier ones left in registers.
  Decoded decode(const Bytes& bytes) {
    Decoded result;
    result.bytes = bytes;
    frame_.fields = result.fields.data();
    frame_.elements = &result.elements;
    frame_.steps = 10'000;
    Bits bits{.data = result.bytes.data(), .at = 0, .end = bytes.size() * 8};
    result.outcome = run(scope_.program(), bits, frame_);
    result.end = bits.at;
    return result;
  }

 private:
  std::vector<FieldRequest> requests_;
  Metadata metadata_;
  BuildContext context_;
  RegisterRange registers_{.next = 0, .end = 8};
  Scope scope_;
  Frame frame_;
};

}  // namespace cie::analysis::ctf::test
