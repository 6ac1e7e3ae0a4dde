// JSON that the command writes, and the little it must read back: the library's own explain text.
#pragma once
#include <concepts>
#include <initializer_list>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace cli {

std::string quoted(const std::string &text);
// What readers of JSON take: names in files, and sentences that cut one, need not be UTF-8.
std::string as_utf8(std::string text);
std::string number(double x);  // shortest text that reads back the same; "null" for what JSON cannot hold

// A number or a truth as JSON; a text is JSON already.
template <class T>
std::string json_of(const T &value) {
  if constexpr (std::same_as<T, bool>) return value ? "true" : "false";
  else if constexpr (std::integral<T>) return std::to_string(value);
  else if constexpr (std::floating_point<T>) return number(value);
  else return value;
}

// Builds "{...}" or "[...]".
class JsonObject {
 public:
  // A key and its value, the next key and its value, ...
  template <class... Texts>
  JsonObject &add(const Texts &...members) {
    static_assert(sizeof...(members) % 2 == 0, "a key has no value");
    append({json_of(members)...});
    return *this;
  }
  std::string text() const;

 private:
  void append(std::initializer_list<std::string> members);
  std::vector<std::pair<std::string, std::string>> members_;
};
template <class... Texts>
std::string json_object(const Texts &...members) {
  return JsonObject().add(members...).text();
}
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
