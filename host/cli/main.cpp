// The command line tool: subcommands, help, and the one place where exceptions become a line and an exit code.
#include <fmt/format.h>

#include <csignal>
#include <exception>
#include <new>

#include "cli/commands.hpp"
#include "cli/driver_guard.hpp"
#include "cli/interrupt.hpp"
#include "cli/terminal.hpp"
#include "core/embedded.hpp"
#include "core/error.hpp"
#include "core/nearest.hpp"

namespace {

using parian::ErrorKind;
using parian::say;

/// Prints the one line that an error is, and returns its exit code.
int report(ErrorKind kind, const std::string& message) {
  say(message);
  return static_cast<int>(kind);
}

/// All "--names" of a subcommand.
std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

/// What was wrong with the command line, and what to do.
int report_usage(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* command = &app;
  for (const CLI::App* chosen : app.get_subcommands()) command = chosen;
  const std::string help = command == &app ? "parian --help" : fmt::format("parian {} --help", command->get_name());
  if (const std::vector<std::string> extras = app.remaining(true); !extras.empty()) {
    const std::string word = extras.front().substr(0, extras.front().find('='));
    std::vector<std::string> names = option_names(*command);
    if (command == &app) {
      for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
        names.push_back(sub->get_name());
      }
    }
    const std::string near = parian::nearest(word, names);
    const bool is_option = word.starts_with('-');
    return report(
        ErrorKind::usage,
        fmt::format("{} '{}'; {}", is_option ? "there is no option" : "nothing is known of the argument", word,
                    near.empty() ? fmt::format("see '{}'", help) : fmt::format("did you mean '{}'?", near)));
  }
  std::string what = error.what();
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error)) what = what.substr(0, what.find(':')) + " needs a value";
  return report(ErrorKind::usage, fmt::format("{}; see '{}'", what, help));
}

int run(int argc, char** argv) {
  CLI::App app("Parian renders translucent materials with the directional dipole, on OpenCL devices.", "parian");
  app.set_version_flag("--version", fmt::format("parian {}", parian::version));
  app.get_formatter()->column_width(34);
  app.require_subcommand(0, 1);
  app.footer(
      "'parian COMMAND --help' tells more.\n"
      "Compiled kernels are kept for drivers that keep none: in parian/programs among your caches, or for any driver\n"
      "in the folder that PARIAN_CACHE names; PARIAN_CACHE=0 keeps none.\n"
      "Exit codes: 0 done, 1 a comparison or check failed, 2 bad usage, 3 bad input, 4 OpenCL or device,\n"
      "5 output could not be written; 130, 143, 129 ended by Ctrl-C, SIGTERM, SIGHUP: render, reference and report\n"
      "finish what is under way and write what they have, all else ends at once.");
  parian::Run chosen;
  parian::add_render(app, chosen);
  parian::add_reference(app, chosen);
  parian::add_compare(app, chosen);
  parian::add_devices(app, chosen);
  parian::add_materials(app, chosen);
  parian::add_report(app, chosen);
  parian::add_check(app, chosen);
  parian::add_bench(app, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);  // --help and --version
  } catch (const CLI::ParseError& error) {
    return report_usage(app, error);
  }
  if (!chosen) return report(ErrorKind::usage, "a command is missing; see 'parian --help'");
  return chosen();
}

/// However main ends, its end is its own.
struct OwnEnd {
  ~OwnEnd() { parian::unguard_drivers(); }
};

}  // namespace

int main(int argc, char** argv) {
  const OwnEnd own_end{};
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error to report, not a reason to die
  parian::keep_standard_streams();
  parian::keep_ignored_signals();
  try {
    const int code = run(argc, argv);
    parian::flush_results();
    return code;
  } catch (const parian::Error& error) {
    return report(error.kind(), error.what());
  } catch (const std::bad_alloc&) {
    return report(ErrorKind::device, "out of memory; use a smaller --size, --layer-size or --light-map-size");
  } catch (const std::system_error& error) {
    return report(ErrorKind::output, fmt::format("{}; check standard output and the files named", error.what()));
  } catch (const std::exception& error) {
    return report(ErrorKind::device, fmt::format("unexpected: {}; please report this", error.what()));
  } catch (...) {
    return report(ErrorKind::device, "unexpected error of unknown kind; please report this");
  }
}
