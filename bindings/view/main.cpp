// deform-view: the program behind `deform view`, which checks the words and hands them over as pairs
// `--name value`.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>

#include "app.h"
#include "leaving.h"
#include "messages.h"
#include "recording.h"

namespace view {
namespace {

void read_size(const std::string &text, Options &out) {
  char rest = 0;
  if (std::sscanf(text.c_str(), "%ux%u%c", &out.width, &out.height, &rest) != 2 || out.width < 64 ||
      out.height < 64 || out.width > 8192 || out.height > 8192)
    throw cli::Failure(cli::kBadInput,
                       "--size " + text + ": expected WIDTHxHEIGHT, each 64 to 8192, such as 1280x720");
}

int run(int argc, char **argv) {
  Options options;
  cli::Globals &globals = cli::session_globals();
  if (argc % 2 == 0) return cli::fail("deform-view is started by `deform view`; see: deform view --help");
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--scene") options.scene = value;
    else if (name == "--replay") options.replay = value;
    else if (name == "--script") options.script = value;
    else if (name == "--from") options.from = value;
    else if (name == "--out") options.out = value;
    else if (name == "--detail") options.detail = value;
    else if (name == "--set") options.set.push_back(value);
    else if (name == "--size") read_size(value, options);
    else if (name == "--threads") globals.threads = unsigned(std::strtoul(value.c_str(), nullptr, 10));
    else if (name == "--quiet") globals.quiet = true;
    else if (name == "--json") globals.json = true;
    else return cli::fail("deform-view is started by `deform view`; see: deform view --help");
  }
  App(options, globals).run();
  return cli::kDone;
}

}  // namespace
}  // namespace view

int main(int argc, char **argv) {
  cli::guard_leaving();
  try {
    return cli::leave(view::run(argc, argv));
  } catch (const cli::Failure &failure) {
    cli::fail(failure.what());
    return cli::leave(failure.exit_code);
  } catch (const std::bad_alloc &) {
    std::fputs("deform: out of memory\n", stderr);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "deform: %s\n", error.what());
  }
  return cli::leave(cli::kBadInput);
}
