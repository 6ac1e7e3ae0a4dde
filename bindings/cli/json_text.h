// JSON that the command writes, and the little it must read back: the library's own explain text.
#pragma once
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace cli {

std::string quoted(const std::string &text);
// What readers of JSON take: names in files, and sentences that cut one, need not be UTF-8.
std::string as_utf8(std::string text);
std::string number(double x);  // shortest text that reads back the same; "null" for what JSON cannot hold

// Builds "{...}" or "[...]"; values are JSON text already.
class JsonObject {
 public:
  JsonObject &add(const std::string &key, const std::string &value);
  std::string text() const;

 private:
  std::vector<std::pair<std::string, std::string>> members_;
};
std::string json_array(const std::vector<std::string> &values);
std::string json_words(const std::vector<std::string> &words);  // quoted
std::string json_numbers(std::span<const double> values);
std::string json_vector(const double v[3]);
std::string indented(const std::string &json);  // objects and arrays of objects on lines of their own

struct JsonMember;
// A parsed value; text of strings is unescaped, numbers and literals keep their text.
struct JsonValue {
  enum Kind { null, literal, string, array, object } kind = null;
  std::string text;
  std::vector<JsonValue> items;
  std::vector<JsonMember> members;
  const JsonValue *find(const std::string &key) const;
  std::string get(const std::string &key) const;                     // text of a member, "" where absent
  double scalar(const std::string &key) const;                       // 0 where absent
  const std::vector<JsonValue> &list(const std::string &key) const;  // items of a member, none where absent
  std::vector<double> numbers(const std::string &key) const;
  // As above, and throw Failure where there is no number, or where there are not n.
  double number(const std::string &key) const;
  std::vector<double> numbers(const std::string &key, size_t n) const;
};
struct JsonMember {
  std::string name;
  JsonValue value;
};
// where: out, the byte at which it stopped to be JSON; why: out, what is wrong there. A key that is given
// twice is wrong.
bool parse_json(const std::string &text, JsonValue &out, size_t *where = nullptr, std::string *why = nullptr);
std::string json_text(const JsonValue &value);  // on one line
// On as many lines as it takes for none to be longer than `width` columns where that can be.
std::string json_lines(const JsonValue &value, size_t width = 110);

}  // namespace cli
