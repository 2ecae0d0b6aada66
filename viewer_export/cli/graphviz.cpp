#include "graphviz.hpp"

#include "base/file.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <system_error>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::cli {
namespace {

std::string temporary_file() { return "a temporary file in \"" P_tmpdir "\""; }

[[noreturn]] void throw_temporary_error(const std::string& what, int error) {
  throw std::system_error(error, std::generic_category(),
                          "cannot " + what + ' ' + temporary_file());
}

// A nameless temporary file.
File temporary() {
  File file(std::tmpfile());
  if (!file) throw_temporary_error("create", errno);
  return file;
}

// Runs `dot -Tsvg` from one file to the other; its status as waitpid gives it.
int run_dot(std::FILE* in, std::FILE* out) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, fileno(in), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(out), STDOUT_FILENO);
  std::string program = "dot";
  std::string form = "-Tsvg";
  const std::array<char*, 3> arguments{program.data(), form.data(), nullptr};
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw std::runtime_error("the program dot of Graphviz cannot be started (" +
                             std::generic_category().message(error) +
                             "): install graphviz, or use --to dot");
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

std::string svg_of(const std::string& dot) {
  const auto in = temporary();
  const auto out = temporary();
  if (std::fwrite(dot.data(), 1, dot.size(), in.get()) != dot.size() ||
      std::fflush(in.get()) != 0) {
    throw_temporary_error("write", errno);
  }
  std::rewind(in.get());
  if (run_dot(in.get(), out.get()) != 0) {
    throw std::runtime_error("the program dot of Graphviz could not draw the graph into " +
                             temporary_file() + ": use --to dot");
  }
  std::rewind(out.get());
  std::string svg;
  std::array<char, 65536> buffer{};
  while (const auto count = std::fread(buffer.data(), 1, buffer.size(), out.get()))
    svg.append(buffer.data(), count);
  return svg;
}

}  // namespace cie::cli
