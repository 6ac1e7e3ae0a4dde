// Text to tree. A scan before the JSON parser limits nesting (so that neither the parser nor later use of the
// tree can exhaust the stack) and finds duplicate keys, which the parser would silently drop.
#include <algorithm>
#include <cctype>
#include <cstring>
#include <set>

#include "core/file.h"
#include "core/names.h"
#include "mesh/raw_mesh.h"
#include "scene/node.h"

namespace dfm::scene {
namespace {

constexpr uint64_t kMaxBytes = 64 * kMiB;
constexpr size_t kMaxDepth = 64;

// With line and column of a byte of the text.
[[noreturn]] void refuse(const std::string &file, const std::string &text, size_t byte,
                         const std::string &sentence) {
  const std::string_view before = std::string_view(text).substr(0, byte);
  const size_t line = 1 + size_t(std::count(before.begin(), before.end(), '\n'));
  const size_t column = before.size() - (before.rfind('\n') + 1) + 1;  // npos + 1 is 0
  fail(DFM_E_FORMAT, "%s:%zu:%zu: %s", file.c_str(), line, column, sentence.c_str());
}

// End of the string that begins at the quote `i` (index of its closing quote, or text.size()).
size_t string_end(const std::string &text, size_t i) {
  for (++i; i < text.size() && text[i] != '"'; ++i)
    if (text[i] == '\\') ++i;
  return std::min(i, text.size());
}

// at: levels that lead to it
void scan(const std::string &text, const std::string &file, size_t at = 0) {
  if (const size_t nul = text.find('\0'); nul != std::string::npos)
    refuse(file, text, nul,
           "not JSON: it contains a NUL character, and readers would ignore what follows; remove it");
  std::vector<std::set<std::string>> keys;  // of each open object; arrays hold none
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '{' || c == '[') {
      if (at + keys.size() >= kMaxDepth)
        refuse(file, text, i, format("brackets nested deeper than %zu levels", kMaxDepth));
      keys.emplace_back();
    } else if (c == '}' || c == ']') {
      if (!keys.empty()) keys.pop_back();
    } else if (c == '"') {
      const size_t end = string_end(text, i);
      size_t next = end + 1;
      while (next < text.size() && std::strchr(" \t\r\n", text[next])) ++next;
      if (next < text.size() && text[next] == ':' && !keys.empty()) {
        std::string key = text.substr(i + 1, end - i - 1);
        if (key.find('\\') != std::string::npos)  // "\u0061" is "a" as well
          if (const json plain = json::parse(text.substr(i, end - i + 1), nullptr, false); plain.is_string())
            key = plain.get<std::string>();
        if (!keys.back().insert(key).second)
          refuse(file, text, i,
                 format("the key \"%.60s\" is given twice in one object; keep one", key.c_str()));
      }
      i = end;
    }
  }
}

// The parser's message without its code and place, which are added separately.
std::string reason(const char *what) {
  std::string text = what;
  const size_t colon = text.find(": ");
  if (colon != std::string::npos) text = text.substr(colon + 2);
  for (char &c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  if (text.size() > 200) text = text.substr(0, 197) + "...";
  return text;
}

// Whether the parser stopped at a way to write NaN or infinity.
bool is_not_finite(const std::string &text, size_t byte) {
  size_t begin = std::min(byte, text.size());
  while (begin > 0 && (std::isalpha(static_cast<unsigned char>(text[begin - 1])) || text[begin - 1] == '-'))
    --begin;
  std::string word;
  for (size_t i = begin; i < text.size() && word.size() < 4; ++i)
    if (text[i] != '-') word += char(std::tolower(static_cast<unsigned char>(text[i])));
  return word.rfind("nan", 0) == 0 || word.rfind("inf", 0) == 0;
}

// The first number outside strings that a double cannot hold, as [begin, end); empty if there is none.
std::pair<size_t, size_t> too_large_number(const std::string &text) {
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') {
      i = string_end(text, i);
    } else if (text[i] == '-' || std::isdigit(static_cast<unsigned char>(text[i]))) {
      const size_t end = std::min(text.find_first_not_of("+-.0123456789eE", i), text.size());
      if (!json::accept(text.substr(i, end - i))) return {i, end};
      i = end - 1;
    }
  }
  return {};
}

}  // namespace

json parse_text(const std::string &text, const std::string &file) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    fail(DFM_E_FORMAT, "%s:1:1: the file is empty; expected a JSON object", file.c_str());
  scan(text, file);
  try {
    return json::parse(text);
  } catch (const json::parse_error &e) {
    refuse(file, text, e.byte > 0 ? e.byte - 1 : 0,
           "not JSON: " + reason(e.what()) + (is_not_finite(text, e.byte) ? "; numbers must be finite" : ""));
  } catch (const json::exception &e) {
    if (const auto [begin, end] = too_large_number(text); end > begin)
      refuse(file, text, begin,
             format("the number %.60s is too large; numbers are at most 1.8e308 in size",
                    text.substr(begin, end - begin).c_str()));
    fail(DFM_E_FORMAT, "%s: not JSON: %s", file.c_str(), reason(e.what()).c_str());
  }
}

namespace {

void refuse_mesh(const std::string &path, const std::string &text) {
  const std::string kind = mesh_kind(path, text);
  if (kind.empty()) return;
  const json name = path.substr(path.find_last_of('/') + 1);
  fail(
      DFM_E_FORMAT,
      "%s: this is a mesh (%s), and a scene is expected; write one beside it: {\"format\": \"deform-scene\", "
      "\"version\": 1, \"time\": {\"duration\": 1}, \"bodies\": [{\"name\": \"body\", \"mesh\": %s}]}, or "
      "look at the mesh: deform mesh info %s",
      path.c_str(), kind.c_str(), name.dump(-1, ' ', false, json::error_handler_t::replace).c_str(),
      shell_word(path).c_str());
}

}  // namespace

json parse_file(const std::string &path) {
  const Array<char> bytes = read_whole_file(Memory::standard(), path, kMaxBytes, "a scene file (JSON)");
  const std::string text(bytes.begin(), bytes.end());
  if (const size_t first = text.find_first_not_of(" \t\r\n"); first != text.npos && text[first] != '{')
    refuse_mesh(path, text);
  return parse_text(text, path);
}

namespace {

std::vector<std::string> steps_of(const std::string &pointer) {
  std::vector<std::string> steps;
  for (size_t i = 0; i < pointer.size();) {
    const size_t end = std::min(pointer.find('/', i + 1), pointer.size());
    std::string step;
    for (size_t k = i + 1; k < end; ++k) {
      if (pointer[k] == '~' && k + 1 < end && (pointer[k + 1] == '0' || pointer[k + 1] == '1'))
        step += pointer[++k] == '0' ? '~' : '/';
      else step += pointer[k];
    }
    steps.push_back(step);
    i = end;
  }
  return steps;
}

bool is_index(const std::string &step) {
  return !step.empty() && step.size() < 10 && step.find_first_not_of("0123456789") == std::string::npos;
}

}  // namespace

void apply_set(json &tree, const std::string &assignment, const std::string &file) {
  const size_t equals = assignment.find('=');
  if (assignment.empty() || assignment[0] != '/' || equals == std::string::npos)
    fail(DFM_E_ARG, "--set %s: expected /json/pointer=value, e.g. --set /time/duration=2",
         assignment.c_str());
  const std::string pointer = assignment.substr(0, equals), text = assignment.substr(equals + 1);
  const std::vector<std::string> steps = steps_of(pointer);
  if (steps.size() > kMaxDepth)
    fail(DFM_E_ARG, "--set %.60s...: a pointer of %zu steps; a scene has at most %zu levels", pointer.c_str(),
         steps.size(), kMaxDepth);
  scan(text, "--set " + pointer, steps.size());
  json value = json::parse(text, nullptr, false);
  if (value.is_discarded()) value = text;  // a bare string
  // Objects on the way are created, so that "/output/every=0.1" works on a scene without "output"; what it
  // then holds is checked as ever.
  json *here = &tree;
  std::string so_far;
  for (const std::string &step : steps) {
    if (here->is_null()) *here = json::object();
    if (here->is_array() && step == "-") {
      here->push_back(nullptr);
      here = &here->back();
    } else if (here->is_array()) {
      if (!is_index(step) || std::stoul(step) >= here->size())
        fail(DFM_E_ARG,
             "--set %s: %s in %s has %zu entries, numbered from 0 (\"-\" appends); there is no \"%s\"",
             pointer.c_str(), so_far.c_str(), file.c_str(), here->size(), step.c_str());
      here = &(*here)[std::stoul(step)];
    } else if (here->is_object()) {
      here = &(*here)[step];
    } else {
      fail(DFM_E_ARG, "--set %s: %s in %s is neither an object nor an array", pointer.c_str(),
           so_far.empty() ? "/" : so_far.c_str(), file.c_str());
    }
    so_far += "/" + step;
  }
  *here = std::move(value);
}

}  // namespace dfm::scene
