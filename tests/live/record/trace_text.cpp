#include "trace_text.hpp"

#include <cstdio>
#include <stdexcept>

namespace cie::test {
namespace {

// Start of a field's value, npos if the event has no such field.
std::size_t find_value(const std::string& text, std::string_view field) {
  std::string key(1, ' ');
  key.append(field).append(" = ");
  const std::size_t at = text.find(key);
  return at == std::string::npos ? at : at + key.size();
}

std::size_t require_value(const std::string& text, std::string_view field) {
  const std::size_t at = find_value(text, field);
  if (at == std::string::npos) {
    throw std::out_of_range("no field " + std::string(field) + " in " + text);
  }
  return at;
}

}  // namespace

bool TextEvent::has(std::string_view field) const {
  return find_value(text, field) != std::string::npos;
}

std::int64_t TextEvent::integer(std::string_view field) const {
  return std::stoll(text.substr(require_value(text, field)));
}

std::string TextEvent::label(std::string_view field) const {
  const std::size_t begin = text.find('"', require_value(text, field)) + 1;
  return text.substr(begin, text.find('"', begin) - begin);
}

std::vector<TextEvent> TextTrace::all(std::string_view name) const {
  std::vector<TextEvent> result;
  for (const TextEvent& event : events) {
    if (event.name == name) {
      result.push_back(event);
    }
  }
  return result;
}

TextTrace TextTrace::of(std::int64_t vpid) const {
  TextTrace result{.events = {}, .is_readable = is_readable};
  for (const TextEvent& event : events) {
    if (event.integer("vpid") == vpid) {
      result.events.push_back(event);
    }
  }
  return result;
}

TextTrace read_trace(const std::filesystem::path& directory) {
  TextTrace trace;
  const std::string command = "timeout 60 babeltrace2 '" + directory.string() + "' 2>/dev/null";
  FILE* const pipe = popen(command.c_str(), "r");
  char* line = nullptr;
  std::size_t capacity = 0;
  while (getline(&line, &capacity, pipe) > 0) {
    const std::string text = line;
    const std::size_t name = text.find(" cie:");
    const std::size_t end = text.find(": {", name);
    if (name != std::string::npos && end != std::string::npos) {
      trace.events.push_back({text.substr(name + 5, end - name - 5), text.substr(end)});
    }
  }
  std::free(line);
  trace.is_readable = pclose(pipe) == 0;
  return trace;
}

}  // namespace cie::test
