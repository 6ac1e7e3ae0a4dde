#include "arguments.h"

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdlib>
#include <type_traits>

namespace cli {

Argument &Argument::required() {
  option_->required();
  return *this;
}

Argument &Argument::type_name(const char *name) {
  option_->type_name(name);
  return *this;
}

Argument &Argument::with_default() {
  option_->capture_default_str();
  return *this;
}

Argument &Argument::positive() {
  option_->check([](const std::string &text) {
    char *end = nullptr;
    const double x = std::strtod(text.c_str(), &end);
    return *end == 0 && x > 0 && std::isfinite(x)
               ? std::string()
               : "expected a finite number above 0, found \"" + text + "\"";
  });
  return *this;
}

Argument &Argument::one_of(std::initializer_list<const char *> words) {
  option_->check(CLI::IsMember(std::vector<std::string>(words.begin(), words.end())));
  return *this;
}

Argument &Argument::values(int count) {
  option_->expected(count);
  return *this;
}

Argument &Argument::repeated() {
  option_->take_all()->allow_extra_args(false);
  return *this;
}

Argument &Argument::separated() {
  option_->inject_separator();
  return *this;
}

Argument &Argument::hidden() {
  option_->group("");
  return *this;
}

Command Command::command(const std::string &name, const std::string &about) {
  return Command(app_->add_subcommand(name, about));
}

template <class Value>
Argument Command::option(const std::string &name, Value &value, const std::string &about) {
  CLI::Option *const option = app_->add_option(name, value, about);
  if constexpr (std::is_unsigned_v<Value>)  // whose conversion takes -1 for the largest
    option->check([](const std::string &text) {
      return text.starts_with('-') ? "expected a whole number, 0 or more, found \"" + text + "\""
                                   : std::string();
    });
  return Argument(option);
}
template Argument Command::option(const std::string &, std::string &, const std::string &);
template Argument Command::option(const std::string &, double &, const std::string &);
template Argument Command::option(const std::string &, int &, const std::string &);
template Argument Command::option(const std::string &, uint32_t &, const std::string &);
template Argument Command::option(const std::string &, uint64_t &, const std::string &);
template Argument Command::option(const std::string &, std::vector<std::string> &, const std::string &);
template Argument Command::option(const std::string &, std::vector<double> &, const std::string &);
template Argument Command::option(const std::string &, std::vector<std::pair<double, std::string>> &,
                                  const std::string &);

void Command::flag(const std::string &name, bool &value, const std::string &about) {
  app_->add_flag(name, value, about);
}

bool Command::given(const std::string &name) const { return app_->count(name) > 0; }
void Command::needs_subcommand() { app_->require_subcommand(1); }
void Command::hide() { app_->group(""); }
void Command::calls(std::function<void()> function) { app_->callback(std::move(function)); }
void Command::calls_at_once(std::function<void()> function) {
  app_->preparse_callback([function = std::move(function)](size_t) { function(); });
}

}  // namespace cli
