#include "script.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "file.h"
#include "messages.h"

namespace view {
namespace {

constexpr uint64_t kMax = uint64_t{1} << 24;  // bytes
constexpr double kEarly = 1e-9;               // s, rounding of the frame clock

// The words of a line, taken one after another.
class Words {
 public:
  Words(const std::string &where, const std::string &line) : where_(where) {
    std::istringstream words(line.substr(0, line.find('#')));
    for (std::string word; words >> word;) words_.push_back(word);
  }
  bool empty() const { return next_ == words_.size(); }
  std::string word(const char *what) {
    if (empty()) refuse(std::string("expected ") + what + ", found the end of the line");
    return words_[next_++];
  }
  double number(const char *what) {
    const std::string text = word(what);
    char *end = nullptr;
    const double x = std::strtod(text.c_str(), &end);
    if (*end || !std::isfinite(x)) refuse(std::string("expected ") + what + ", found \"" + text + "\"");
    return x;
  }
  // The next word where it is one of these.
  int choice(std::initializer_list<const char *> names) {
    int i = 0;
    for (const char *name : names) {
      if (!empty() && words_[next_] == name) {
        ++next_;
        return i;
      }
      ++i;
    }
    return -1;
  }
  [[noreturn]] void refuse(const std::string &sentence) const {
    throw cli::Failure(cli::kBadInput, where_ + ": " + sentence);
  }

 private:
  std::string where_;
  std::vector<std::string> words_;
  size_t next_ = 0;
};

void read_drag(Words &words, ScriptLine &out) {
  out.button = std::max(words.choice({"left", "right", "middle"}), 0);
  for (double *p : {out.from, out.to})
    for (int i = 0; i < 2; ++i) p[i] = words.number("a drag's x0 y0 x1 y1 in pixels");
  if (!words.empty()) out.seconds = words.number("how many seconds a drag takes");
  if (!words.empty()) out.hold = words.number("for how many seconds a drag is held");
  if (!(out.seconds >= 0) || !(out.hold >= 0)) words.refuse("a drag takes and is held for 0 s or more");
}

ScriptLine read_line(Words &words) {
  ScriptLine out;
  out.t = words.number("a time in seconds");
  if (out.t < 0) words.refuse("expected a time of 0 s or more, found " + std::to_string(out.t));
  const int kind = words.choice({"key", "drag", "slider", "shot"});
  if (kind < 0)
    words.refuse("expected key, drag, slider or shot, found \"" + words.word("one of them") + "\"");
  out.kind = ScriptLine::Kind(kind);
  if (out.kind == ScriptLine::key) {
    out.name = words.word("the name of a key");
  } else if (out.kind == ScriptLine::drag) {
    read_drag(words, out);
  } else if (out.kind == ScriptLine::slider) {
    out.name = words.word("the name of a slider");
    out.value = words.number("the slider's value");
  } else {
    out.name = words.word("a file's name");
  }
  if (!words.empty()) words.refuse("\"" + words.word("") + "\" is not expected here");
  return out;
}

Input mouse(Input::Kind kind, const double at[2], int button) {
  Input in;
  in.kind = kind;
  in.x = at[0];
  in.y = at[1];
  in.button = button;
  return in;
}

}  // namespace

Script::Script(const std::string &path) : path_(path) {
  std::istringstream text(cli::read_file(path, kMax, "a script of `deform view`"));
  size_t number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    Words words(path + ":" + std::to_string(number), line);
    if (words.empty()) continue;
    lines_.push_back(read_line(words));
    lines_.back().line = number;
  }
  std::stable_sort(lines_.begin(), lines_.end(),
                   [](const ScriptLine &a, const ScriptLine &b) { return a.t < b.t; });
}

void Script::frame(double t, std::vector<Input> &inputs, std::vector<ScriptLine> &current) {
  for (const ScriptLine &d : drags_) {
    const double way = d.seconds > 0 ? std::min((t - d.t) / d.seconds, 1.0) : 1;
    const double at[2] = {d.from[0] + way * (d.to[0] - d.from[0]), d.from[1] + way * (d.to[1] - d.from[1])};
    inputs.push_back(mouse(Input::move, at, d.button));
  }
  std::erase_if(drags_, [&](const ScriptLine &d) {
    if (t < d.t + d.seconds + d.hold - kEarly) return false;
    inputs.push_back(mouse(Input::release, d.to, d.button));
    return true;
  });
  for (; next_ < lines_.size() && lines_[next_].t <= t + kEarly; ++next_) {
    const ScriptLine &line = lines_[next_];
    if (line.kind == ScriptLine::key) {
      Input in;
      in.kind = Input::key;
      in.name = line.name;
      inputs.push_back(in);
    } else if (line.kind == ScriptLine::drag) {
      inputs.push_back(mouse(Input::move, line.from, line.button));
      inputs.push_back(mouse(Input::press, line.from, line.button));
      drags_.push_back(line);
      drags_.back().t = t;
    } else {
      current.push_back(line);
    }
  }
}

}  // namespace view
