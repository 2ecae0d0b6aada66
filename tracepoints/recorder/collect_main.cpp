// cie-collect: receives what `cie record --to` of several machines sends.
#include "base/help_text.hpp"
#include "base/messages.hpp"
#include "base/network_address.hpp"
#include "collection.hpp"
#include "system/connection.hpp"
#include "system/error.hpp"
#include "version.hpp"

#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace {

constexpr int kUsage = 2;
constexpr int kFailed = 4;

int wrong_usage(const std::string& what) {
  cie::tell_wrong_usage(what, "cie collect");
  return kUsage;
}

cie::NetworkAddress listen_address(const std::string& text) {
  const auto address = cie::parse_listen_address(text, cie::record::kRelayPort);
  if (!address) {
    throw cie::record::UsageError(
        fmt::format("--listen takes PORT, HOST or HOST:PORT, of IPv6 [HOST]:PORT: \"{}\"", text));
  }
  if (address->port > UINT16_MAX - 2) {
    throw cie::record::UsageError(fmt::format(
        "--listen: three ports follow each other; there are none after {}", address->port));
  }
  return *address;
}

}  // namespace

// What escapes is a lack of memory. NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
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
      "Exit codes: 0 ended by a signal, 2 wrong usage, 4 no relay daemon.");
  std::string directory;
  std::string listen = fmt::format("127.0.0.1:{}", cie::record::kRelayPort);
  app.add_option("-o,--output", directory, "Directory for the recordings")->type_name("DIR");
  app.add_option("--listen", listen, "Where to listen; port 0: any (default: 127.0.0.1:5342)")
      ->type_name("[ADDRESS:]PORT");
  app.set_version_flag("--version", std::string("cie-collect ") + cie::kToolVersion);
  try {
    app.allow_extras();  // judged below, with a suggestion
    app.parse(argc, argv);
    if (const auto unexpected = cie::unexpected_argument(app); !unexpected.empty())
      throw cie::record::UsageError(unexpected);
    if (directory.empty()) {
      throw cie::record::UsageError(
          "no DIR was given: name the directory for the recordings with -o");
    }
    cie::record::CollectOptions options;
    options.directory = std::filesystem::absolute(directory).lexically_normal();
    options.listen = listen_address(listen);
    cie::record::Collection(options).run();
    return 0;
  } catch (const CLI::CallForHelp&) {
    std::fputs(app.help().c_str(), stdout);
    return 0;
  } catch (const CLI::CallForVersion&) {
    std::printf("cie-collect %s\n", cie::kToolVersion);
    return 0;
  } catch (const CLI::ParseError& error) {
    return wrong_usage(cie::in_words_of_help(app, error));
  } catch (const cie::record::UsageError& error) {
    return wrong_usage(error.what());
  } catch (const std::exception& error) {
    cie::tell(error.what());
    return kFailed;
  }
}
