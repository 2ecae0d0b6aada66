// The machine a scheduling spec was written for.
#include <cie/tracepoints/scheduling_spec.hpp>

#include "base/file.hpp"
#include "base/text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <map>

namespace cie {
namespace {

// "Thread(s) per core" as configurators write it: threads_per_core.
std::string field_name(std::string_view lscpu_name) {
  std::string name;
  for (const char c : lscpu_name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0) {
      name += static_cast<char>(std::tolower(byte));
    } else if (c != '(' && c != ')' && !name.empty() && name.back() != '_') {
      name += '_';
    }
  }
  return name;
}

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

std::map<std::string, std::string, std::less<>> read_fields(std::string_view lscpu) {
  std::map<std::string, std::string, std::less<>> fields;
  while (!lscpu.empty()) {
    const auto end = std::min(lscpu.find('\n'), lscpu.size());
    const std::string_view line = lscpu.substr(0, end);
    lscpu.remove_prefix(std::min(end + 1, lscpu.size()));
    const auto colon = line.find(':');
    if (colon == std::string_view::npos) continue;
    // The first of a name counts; those below it are of other kinds of CPU.
    fields.emplace(field_name(trimmed(line.substr(0, colon))), trimmed(line.substr(colon + 1)));
  }
  return fields;
}

// 2101 is 2101.0000.
bool is_same(const std::string& a, const std::string& b) {
  const auto number = parse_number<double>(a);
  return a == b || (number && number == parse_number<double>(b));
}

std::string run_lscpu() {
  const Pipe stream{popen("LC_ALL=C exec lscpu 2>/dev/null", "re")};
  std::string text;
  std::array<char, 4096> buffer{};
  while (stream != nullptr) {
    const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), stream.get());
    if (size == 0) break;
    text.append(buffer.data(), size);
  }
  return text;
}

}  // namespace

void check_hardware_info(const SchedulingSpec& spec, std::string_view lscpu) {
  const auto found = read_fields(lscpu);
  std::string problems;
  for (std::size_t i = 0; i < spec.hardware_info().size(); ++i) {
    const auto& [name, expected] = spec.hardware_info()[i];
    if (expected.empty()) continue;
    const auto field = found.find(name);
    if (field != found.end() && is_same(field->second, expected)) continue;
    if (!problems.empty()) problems += '\n';
    problems.append(spec.name()).append(":");
    problems.append(std::to_string(spec.hardware_info_lines()[i]));
    problems.append(": entry \"hardware_info\": \"").append(name);
    problems.append("\" should be \"").append(expected).append("\", ");
    if (field == found.end()) {
      problems.append("lscpu reports no such field");
    } else {
      problems.append("this machine has \"").append(field->second).append("\"");
    }
    problems.append("; the spec is for another machine, or the field is to be removed");
  }
  if (!problems.empty()) throw SpecError(problems);
}

void check_hardware_info(const SchedulingSpec& spec) {
  if (spec.hardware_info().empty()) return;
  const std::string lscpu = run_lscpu();
  if (lscpu.empty()) {
    throw SpecError(spec.name() +
                    ": \"hardware_info\" cannot be checked: lscpu (Debian package util-linux) "
                    "cannot be run");
  }
  check_hardware_info(spec, lscpu);
}

}  // namespace cie
