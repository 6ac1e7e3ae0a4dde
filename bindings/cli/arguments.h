// The command line of a subcommand: its options and what it calls. Only arguments.cpp and main.cpp include
// CLI11 behind it, which takes 4 s of the compiler's time in each file.
#pragma once
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace cli {

// What else holds for an option.
class Argument {
 public:
  explicit Argument(CLI::Option *option) : option_(option) {}
  Argument &required();
  Argument &type_name(const char *name);  // of its value, in the help; N: a whole number
  Argument &with_default();               // the help shows the present value
  Argument &positive();                   // a finite number above 0
  Argument &one_of(std::initializer_list<const char *> words);
  Argument &values(int count);
  Argument &repeated();   // one value each time that it is written
  Argument &separated();  // an empty value stands between what two of them give
  Argument &hidden();

 private:
  CLI::Option *option_;
};

class Command {
 public:
  explicit Command(CLI::App *app) : app_(app) {}
  Command command(const std::string &name, const std::string &about = {});
  // A name without dashes is one of a word by its place. The value keeps what it has where the option is not
  // given; it lives until the command line has been read.
  template <class Value>  // those of arguments.cpp
  Argument option(const std::string &name, Value &value, const std::string &about = {});
  void flag(const std::string &name, bool &value, const std::string &about);
  bool given(const std::string &name) const;
  void needs_subcommand();
  void hide();  // from the help
  void calls(std::function<void()> function);
  // As soon as the subcommand's name is read, and before anything that stands behind it.
  void calls_at_once(std::function<void()> function);

 private:
  CLI::App *app_;
};

}  // namespace cli
