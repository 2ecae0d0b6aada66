#include "snapshot_json.hpp"

#include "json/row_json.hpp"
#include "snapshot_fields.hpp"

#include <sstream>
#include <stdexcept>

namespace cie::live {
namespace {

using viewer_export::Json;

constexpr std::string_view kSchema = "cie.live/1";

std::runtime_error refusal(const char* why) {
  return std::runtime_error(std::string("not a line of cie.live/1: ") + why);
}

}  // namespace

std::string json_line(const Snapshot& snapshot, bool with_recent) {
  std::ostringstream line;
  viewer_export::JsonText json(line, viewer_export::JsonText::kOneLine);
  const viewer_export::RowContext context{.has_details = with_recent};
  viewer_export::RowWriter document(json, context);
  json.object([&] {
    document("schema", kSchema);
    fields(document, snapshot);
  });
  json.flush();
  return line.str();
}

Snapshot parse_snapshot(std::string_view line) {
  try {
    const auto json = Json::parse(line);
    if (json.at("schema") == kSchema) {
      Snapshot snapshot;
      viewer_export::RowReader reader(json);
      fields(reader, snapshot);
      return snapshot;
    }
  } catch (const Json::exception& error) {
    throw refusal(error.what());
  } catch (const std::runtime_error& error) {  // a label that nothing has
    throw refusal(error.what());
  }
  throw std::runtime_error("not a line of cie.live/1");
}

}  // namespace cie::live
