#include "json_text.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <set>

#include "messages.h"

namespace cli {

std::string quoted(const std::string &text) {
  std::string out = "\"";
  for (const char c : text) {
    const unsigned char u = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (c == '\n') {
      out += "\\n";
    } else if (u < 0x20) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04x", u);
      out += escape;
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string as_utf8(std::string text) {
  for (size_t i = 0; i < text.size();) {
    const auto byte = [&](size_t k) {
      return i + k < text.size() ? static_cast<unsigned char>(text[i + k]) : 0;
    };
    const unsigned lead = byte(0);
    const size_t n = lead < 0x80 ? 1 : lead >= 0xc2 && lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    bool good = lead < 0x80 || (lead >= 0xc2 && lead <= 0xf4);
    for (size_t k = 1; k < n; ++k) good = good && byte(k) >> 6 == 2;
    if (n == 3) good = good && (lead > 0xe0 || byte(1) >= 0xa0) && (lead != 0xed || byte(1) < 0xa0);
    if (n == 4) good = good && (lead > 0xf0 || byte(1) >= 0x90) && (lead < 0xf4 || byte(1) < 0x90);
    if (!good) text[i] = '?';
    i += good ? n : 1;
  }
  return text;
}

std::string number(double x) {
  if (!std::isfinite(x)) return "null";
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, x);
  return std::string(text, end.ptr);
}

void JsonObject::append(std::initializer_list<std::string> members) {
  for (const std::string *m = members.begin(); m != members.end(); m += 2) members_.emplace_back(m[0], m[1]);
}

std::string JsonObject::text() const {
  std::string out = "{";
  for (const auto &[key, value] : members_) out += (out.size() > 1 ? ", " : "") + quoted(key) + ": " + value;
  return out + "}";
}

std::string json_array(const std::vector<std::string> &values) {
  std::string out = "[";
  for (const std::string &v : values) out += (out.size() > 1 ? ", " : "") + v;
  return out + "]";
}

std::string json_words(const std::vector<std::string> &words) {
  std::vector<std::string> items;
  for (const std::string &w : words) items.push_back(quoted(w));
  return json_array(items);
}

std::string json_numbers(std::span<const double> values) {
  std::vector<std::string> items;
  for (const double x : values) items.push_back(number(x));
  return json_array(items);
}

std::string json_vector(const double v[3]) { return json_numbers({v, 3}); }

std::string indented(const std::string &json) {
  std::string out;
  int depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    out += c;
    if (in_string) {
      if (c == '\\') out += json[++i];
      else if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      ++depth;
      if (depth == 1) out += "\n  ";
    } else if (c == '}' || c == ']') {
      if (--depth == 0) out.insert(out.size() - 1, "\n");
    } else if (c == ',' && depth == 1) {
      out += "\n ";
    }
  }
  return out + "\n";
}

const JsonValue *JsonValue::find(const std::string &key) const {
  for (const auto &[name, value] : members)
    if (name == key) return &value;
  return nullptr;
}

std::string JsonValue::get(const std::string &key) const {
  const JsonValue *v = find(key);
  return v && v->kind != JsonValue::null ? v->text : std::string();
}

double JsonValue::scalar(const std::string &key) const { return std::strtod(get(key).c_str(), nullptr); }

std::vector<double> JsonValue::numbers(const std::string &key) const {
  std::vector<double> out;
  for (const JsonValue &item : list(key)) out.push_back(std::strtod(item.text.c_str(), nullptr));
  return out;
}

namespace {

bool is_number(const std::string &text) {
  const char *at = text.c_str();
  const auto take = [&](const char *any) { return *at && std::strchr(any, *at) && ++at; };
  const auto digits = [&] {
    const bool some = take("0123456789");
    while (take("0123456789")) continue;
    return some;
  };
  take("-");
  if (!take("0") && !digits()) return false;
  if (take(".") && !digits()) return false;
  if (take("eE") && (take("+-"), !digits())) return false;
  return !*at;
}

double number_in(const JsonValue &value, const std::string &key) {
  if (value.kind != JsonValue::literal || !is_number(value.text))
    throw Failure(kBadInput, "expected a number under \"" + key + "\"");
  return std::strtod(value.text.c_str(), nullptr);
}

}  // namespace

double JsonValue::number(const std::string &key) const {
  const JsonValue *const v = find(key);
  return number_in(v ? *v : JsonValue(), key);
}

std::vector<double> JsonValue::numbers(const std::string &key, size_t n) const {
  std::vector<double> out;
  for (const JsonValue &item : list(key)) out.push_back(number_in(item, key));
  if (out.size() != n)
    throw Failure(kBadInput, "expected " + std::to_string(n) + " numbers under \"" + key + "\"");
  return out;
}

const std::vector<JsonValue> &JsonValue::list(const std::string &key) const {
  static const std::vector<JsonValue> none;
  const JsonValue *v = find(key);
  return v ? v->items : none;
}

namespace {

class Reader {
 public:
  explicit Reader(const std::string &text) : s_(text), i_(text.starts_with("\xef\xbb\xbf") ? 3 : 0) {}
  bool value(JsonValue &out, int depth) {
    space();
    if (i_ >= s_.size() || depth > 64) return false;
    if (s_[i_] == '{') return object(out, depth);
    if (s_[i_] == '[') return array(out, depth);
    if (s_[i_] == '"') {
      out.kind = JsonValue::string;
      return string(out.text);
    }
    const size_t begin = i_;
    while (i_ < s_.size() && std::string(",]} \t\r\n").find(s_[i_]) == std::string::npos) ++i_;
    out.text = s_.substr(begin, i_ - begin);
    out.kind = out.text == "null" ? JsonValue::null : JsonValue::literal;
    const bool word = out.text == "null" || out.text == "true" || out.text == "false";
    if (word || is_number(out.text)) return true;
    i_ = begin;
    return false;
  }
  bool end() {
    space();
    return i_ == s_.size();
  }
  size_t at() const { return i_; }
  const std::string &why() const { return why_; }

 private:
  void space() {
    while (i_ < s_.size() && std::string(" \t\r\n").find(s_[i_]) != std::string::npos) ++i_;
  }
  bool take(char c) {
    space();
    if (i_ >= s_.size() || s_[i_] != c) return false;
    ++i_;
    return true;
  }
  bool string(std::string &out) {
    if (!take('"')) return false;
    for (; i_ < s_.size() && s_[i_] != '"'; ++i_) {
      if (static_cast<unsigned char>(s_[i_]) < 0x20) return false;
      if (s_[i_] != '\\') {
        out += s_[i_];
        continue;
      }
      if (++i_ >= s_.size()) return false;
      const char c = s_[i_];
      if (c == 'u') {
        if (!character(out)) return false;
      } else {
        out += c == 'n' ? '\n' : c == 't' ? '\t' : c == 'r' ? '\r' : c == 'b' ? '\b' : c == 'f' ? '\f' : c;
      }
    }
    return take('"');
  }
  // The four digits behind \u, at i_; leaves i_ on the last one.
  bool unit(uint32_t &out) {
    const char *const from = s_.data() + i_ + 1;
    if (i_ + 4 >= s_.size() || std::from_chars(from, from + 4, out, 16).ptr != from + 4) return false;
    i_ += 4;
    return true;
  }
  bool character(std::string &out) {
    uint32_t code = 0, low = 0;
    if (!unit(code)) return false;
    if (code >= 0xd800 && code < 0xe000) {  // half of a pair
      if (code >= 0xdc00 || s_.compare(i_ + 1, 2, "\\u") != 0) return false;
      i_ += 2;
      if (!unit(low) || low < 0xdc00 || low >= 0xe000) return false;
      code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
    }
    const auto add = [&](uint32_t byte) { out += static_cast<char>(byte); };
    if (code < 0x80) {
      add(code);
      return true;
    }
    if (code < 0x800) {
      add(0xc0 | code >> 6);
    } else if (code < 0x10000) {
      add(0xe0 | code >> 12);
    } else {
      add(0xf0 | code >> 18);
      add(0x80 | (code >> 12 & 0x3f));
    }
    if (code >= 0x800) add(0x80 | (code >> 6 & 0x3f));
    add(0x80 | (code & 0x3f));
    return true;
  }
  bool array(JsonValue &out, int depth) {
    out.kind = JsonValue::array;
    take('[');
    if (take(']')) return true;
    do {
      out.items.emplace_back();
      if (!value(out.items.back(), depth + 1)) return false;
    } while (take(','));
    return take(']');
  }
  bool object(JsonValue &out, int depth) {
    out.kind = JsonValue::object;
    take('{');
    if (take('}')) return true;
    std::set<std::string> names;
    do {
      out.members.emplace_back();
      space();
      if (!string(out.members.back().name)) return false;
      if (!names.insert(out.members.back().name).second) {
        why_ = "a key is given twice in one object; keep one";
        return false;
      }
      if (!take(':') || !value(out.members.back().value, depth + 1)) return false;
    } while (take(','));
    return take('}');
  }
  const std::string &s_;
  size_t i_;  // behind the mark of UTF-8 that editors may begin with
  std::string why_ = "this is not JSON";
};

}  // namespace

std::string json_text(const JsonValue &value) {
  if (value.kind == JsonValue::null) return "null";
  if (value.kind == JsonValue::string) return quoted(value.text);
  if (value.kind == JsonValue::literal) return value.text;
  std::vector<std::string> items;
  if (value.kind == JsonValue::array) {
    for (const JsonValue &item : value.items) items.push_back(json_text(item));
    return json_array(items);
  }
  JsonObject out;
  for (const auto &[name, member] : value.members) out.add(name, json_text(member));
  return out.text();
}

namespace {

void lines(const JsonValue &value, size_t width, size_t depth, size_t before, std::string &out) {
  const std::string whole = json_text(value);
  const bool list = value.kind == JsonValue::array;
  if ((!list && value.kind != JsonValue::object) || before + whole.size() < width || whole.size() < 3) {
    out += whole;
    return;
  }
  const std::string indent(2 * depth + 2, ' ');
  const char *separator = "\n";
  out += list ? '[' : '{';
  const auto begin = [&] {
    out += separator + indent;
    separator = ",\n";
  };
  for (const JsonValue &item : value.items) {
    begin();
    lines(item, width, depth + 1, indent.size(), out);
  }
  for (const auto &[name, member] : value.members) {
    begin();
    const std::string key = quoted(name) + ": ";
    out += key;
    lines(member, width, depth + 1, indent.size() + key.size(), out);
  }
  out += "\n" + std::string(2 * depth, ' ') + (list ? ']' : '}');
}

}  // namespace

std::string json_lines(const JsonValue &value, size_t width) {
  std::string out;
  lines(value, width, 0, 0, out);
  return out + "\n";
}

bool parse_json(const std::string &text, JsonValue &out, size_t *where, std::string *why) {
  Reader reader(text);
  const bool good = reader.value(out, 0) && reader.end();
  if (where) *where = reader.at();
  if (why) *why = reader.why();
  return good;
}

}  // namespace cli
