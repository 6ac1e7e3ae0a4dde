// deform contact FILE|FOLDER...: starts deform-contact, which solves contact problems by themselves.
#include <memory>

#include "arguments.h"
#include "become.h"
#include "cli.h"

namespace cli {

void add_contact(Command app, Globals &globals, int *) {
  struct Options {
    std::vector<std::string> paths;
    std::string folder;
  };
  auto options = std::make_shared<Options>();
  Command sub =
      app.command("contact", "solves contact problems of `run --contact-problems`, FCLIB or Siconos");
  sub.option("PATH", options->paths, "files, or folders of them").required();
  sub.option("--export", options->folder, "write the problems to DIR in FCLIB's format").type_name("DIR");
  sub.calls([=, &globals] {
    std::vector<std::string> words;
    if (globals.json) words.push_back("--json");
    if (!options->folder.empty()) words.insert(words.end(), {"--export", options->folder});
    words.push_back("--");
    words.insert(words.end(), options->paths.begin(), options->paths.end());
    become("contact", "deform-contact", words, kNoContact);
  });
}

}  // namespace cli
