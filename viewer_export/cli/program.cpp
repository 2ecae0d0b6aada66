#include "program.hpp"

#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/viewer_export/output_file.hpp>

#include "base/messages.hpp"
#include "command_line.hpp"
#include "exit_code.hpp"
#include "output.hpp"

#include <csignal>
#include <cstdio>
#include <new>
#include <string_view>

#include <fcntl.h>
#include <unistd.h>

namespace cie::cli {
namespace {

int fail(std::string_view what, int code) {
  tell(what);
  return code;
}

// As programs end that do not know of the pipe: quietly, by SIGPIPE (a shell says 141). Everything
// that was held has been given back.
int end_with_the_pipe() {
  std::signal(SIGPIPE, SIG_DFL);
  std::raise(SIGPIPE);
  return unreadable;  // the signal is blocked
}

}  // namespace

void reserve_standard_descriptors() {
  for (int descriptor = ::open("/dev/null", O_RDONLY); descriptor >= 0;
       descriptor = ::open("/dev/null", O_RDONLY)) {
    if (descriptor > STDERR_FILENO) {
      ::close(descriptor);
      return;
    }
  }
}

void turn_signals_into_errors() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  end_with_a_message_instead_of_aborting();
}

int run_command(int (*command)(const Arguments&), const Arguments& arguments,
                const std::string& name) {
  try {
    return command(arguments);
  } catch (const UsageError& error) {
    tell_wrong_usage(error.what(), name);
    return usage_error;
  } catch (const analysis::SeveralClocks& error) {
    tell_wrong_usage(std::string("--window: ") + error.what(), name);
    return usage_error;
  } catch (const SpecError& error) {
    return fail(error.what(), usage_error);
  } catch (const viewer_export::ClosedPipe&) {
    return end_with_the_pipe();
  } catch (const analysis::UnreadableTrace& error) {
    return fail(error.what(), unreadable);
  } catch (const std::bad_alloc&) {
    return fail("out of memory", unreadable);
  } catch (const std::exception& error) {
    return fail(error.what(), unreadable);
  }
}

int print_text(const std::string& text) {
  viewer_export::OutputFile out("-");
  out.stream() << text;
  out.commit();
  return ok;
}

}  // namespace cie::cli
