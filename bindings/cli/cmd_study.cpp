// deform sweep, deform fit: programs of the Python package, which this becomes.
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "arguments.h"
#include "become.h"
#include "cli.h"
#include "messages.h"

namespace cli {
namespace {

// The folder from which a script is started is no place to look for packages: `deform` may be a folder there.
constexpr const char *kStart =
    "import sys\n"
    "if sys.path[0] == '': del sys.path[0]\n"
    "sys.path += filter(None, [sys.argv.pop(1)])\n"
    "try:\n"
    "    from deform.study.__main__ import main\n"
    "except ImportError as error:\n"
    "    sys.exit(print(f'deform: {sys.argv[1]}: {sys.executable} cannot import the Python package deform '\n"
    "                   f'({error}); install it for that interpreter (pip install .; Debian: '\n"
    "                   f'python3-deform, python3-numpy), or name another one in DEFORM_PYTHON',\n"
    "                   file=sys.stderr) or 2)\n"
    "except KeyboardInterrupt:\n"
    "    sys.exit(130)\n"
    "sys.exit(main())\n";

void set_if_unset(const char *name, const std::string &value) { setenv(name, value.c_str(), 0); }

// The package that belongs to this command: in a build folder beside it, in a wheel around it. Elsewhere (a
// Debian package, `make install`) the interpreter knows where it is. Returns the folder that kStart appends
// to the interpreter's: a wheel's has other packages, too, which must not hide the standard library.
std::string name_package() {
  namespace fs = std::filesystem;
  set_if_unset("DEFORM_COMMAND", beside("deform"));
  if (fs::exists(beside("../python/deform/study/__main__.py"))) {
    set_if_unset("DEFORM_LIBRARY", beside("../lib/libdeform.so.0"));
    const std::string folder = beside("../python");
    const char *const before = std::getenv("PYTHONPATH");
    setenv("PYTHONPATH", (before && *before ? folder + ":" + before : folder).c_str(), 1);
  }
  return fs::exists(beside("../../study/__main__.py")) ? beside("../../..") : "";
}

[[noreturn]] void become_python(const std::string &subcommand, const std::vector<std::string> &words) {
  const std::string appended = name_package();
  const std::vector<std::string> interpreters = pythons();
  for (const std::string &python : interpreters) {
    std::vector<const char *> argv{python.c_str(), "-B", "-c", kStart, appended.c_str()};
    for (const std::string &word : words) argv.push_back(word.c_str());
    argv.push_back(nullptr);
    execvp(python.c_str(), const_cast<char **>(argv.data()));
  }
  throw Failure(kBadInput, subcommand + ": the Python interpreter " + interpreters[0] +
                               " cannot be started: " + std::strerror(errno) +
                               "; install python3, or name one in DEFORM_PYTHON");
}

}  // namespace

void add_study(Command app, const Globals &globals, const char *name, const char *about) {
  const std::string subcommand = name;
  app.command(name, about).calls_at_once([&globals, subcommand] {
    become_python(subcommand, globals.words);
  });
}

}  // namespace cli
