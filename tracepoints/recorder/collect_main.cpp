// cie-collect: receives what `cie record --to` of several machines sends.
#include "base/help_text.hpp"
#include "base/network_address.hpp"
#include "base/program.hpp"
#include "collection.hpp"
#include "system/connection.hpp"
#include "version.hpp"

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace {

cie::NetworkAddress listen_address(const std::string& text) {
  const auto address = cie::parse_listen_address(text, cie::record::kRelayPort);
  if (!address) {
    throw cie::UsageError(
        fmt::format("--listen takes PORT, HOST or HOST:PORT, of IPv6 [HOST]:PORT: \"{}\"", text));
  }
  if (address->port > UINT16_MAX - 2) {
    throw cie::UsageError(fmt::format(
        "--listen: three ports follow each other; there are none after {}", address->port));
  }
  return *address;
}

int run(const std::vector<std::string>& arguments) {
  CLI::App app{
      "Receives what cie record --to of several machines sends, until Ctrl-C, into one "
      "directory.",
      "cie collect"};
  cie::lay_out_help(app, "cie collect -o DIR [OPTIONS]");
  app.footer(
      "It runs a relay daemon of LTTng, on three ports that follow each other: control, data, live "
      "readers.\n"
      "What arrives is neither encrypted nor authenticated: listen where only your machines "
      "reach,\n"
      "or tunnel two ports (ssh -L). DIR/HOST/SESSION-DATE holds what one machine sent; all of "
      "them\n"
      "together: cie report DIR. A directory that is there already is continued.\n"
      "Exit codes: 0 ended by a signal, 2 wrong usage, 4 no relay daemon, or no space was left.");
  std::string directory;
  std::string listen = fmt::format("127.0.0.1:{}", cie::record::kRelayPort);
  app.add_option("-o,--output", directory, "Directory for the recordings")->type_name("DIR");
  app.add_option("--listen", listen, "Where to listen; port 0: any (default: 127.0.0.1:5342)")
      ->type_name("[ADDRESS:]PORT");
  app.set_version_flag("--version", std::string("cie-collect ") + cie::kToolVersion);
  if (const auto text = cie::parse_arguments(app, arguments)) {
    std::fputs(text->c_str(), stdout);
    return cie::kSuccess;
  }
  if (directory.empty()) {
    throw cie::UsageError("no DIR was given: name the directory for the recordings with -o");
  }
  cie::record::CollectOptions options;
  options.directory = std::filesystem::absolute(directory).lexically_normal();
  options.listen = listen_address(listen);
  cie::record::Collection(options).run();
  return cie::kSuccess;
}

}  // namespace

int main(int argc, char** argv) {
  return cie::run_program("cie collect", "cie", [&] { return run({argv + 1, argv + argc}); });
}
