#include "json_text.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace cli {

std::string quoted(const std::string &text) {
  std::string out = "\"";
  for (const char c : text) {
    const unsigned char u = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') out += '\\', out += c;
    else if (c == '\n') out += "\\n";
    else if (u < 0x20) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04x", u);
      out += escape;
    } else out += c;
  }
  return out + "\"";
}

std::string number(double x) {
  if (!std::isfinite(x)) return "null";
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, x);
  return std::string(text, end.ptr);
}

JsonObject &JsonObject::add(const std::string &key, const std::string &value) {
  members_.emplace_back(key, value);
  return *this;
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

std::string json_vector(const double v[3]) { return json_array({number(v[0]), number(v[1]), number(v[2])}); }

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

namespace {

class Reader {
 public:
  explicit Reader(const std::string &text) : s_(text) {}
  bool value(JsonValue &out, int depth) {
    space();
    if (i_ >= s_.size() || depth > 64) return false;
    if (s_[i_] == '{') return object(out, depth);
    if (s_[i_] == '[') return array(out, depth);
    if (s_[i_] == '"') return out.kind = JsonValue::string, string(out.text);
    const size_t begin = i_;
    while (i_ < s_.size() && std::string(",]} \t\r\n").find(s_[i_]) == std::string::npos) ++i_;
    out.text = s_.substr(begin, i_ - begin);
    out.kind = out.text == "null" ? JsonValue::null : JsonValue::literal;
    return i_ > begin;
  }
  bool end() {
    space();
    return i_ == s_.size();
  }
  size_t at() const { return i_; }

 private:
  void space() {
    while (i_ < s_.size() && std::string(" \t\r\n").find(s_[i_]) != std::string::npos) ++i_;
  }
  bool take(char c) {
    space();
    if (i_ >= s_.size() || s_[i_] != c) return false;
    return ++i_, true;
  }
  bool string(std::string &out) {
    if (!take('"')) return false;
    for (; i_ < s_.size() && s_[i_] != '"'; ++i_) {
      if (s_[i_] != '\\') {
        out += s_[i_];
        continue;
      }
      if (++i_ >= s_.size()) return false;
      const char c = s_[i_];
      if (c == 'u' && i_ + 4 < s_.size()) {
        out += static_cast<char>(std::strtol(s_.substr(i_ + 1, 4).c_str(), nullptr, 16));  // control characters only, as we write them
        i_ += 4;
      } else out += c == 'n' ? '\n' : c == 't' ? '\t' : c == 'r' ? '\r' : c;
    }
    return take('"');
  }
  bool array(JsonValue &out, int depth) {
    out.kind = JsonValue::array;
    if (take('['), take(']')) return true;
    do {
      out.items.emplace_back();
      if (!value(out.items.back(), depth + 1)) return false;
    } while (take(','));
    return take(']');
  }
  bool object(JsonValue &out, int depth) {
    out.kind = JsonValue::object;
    if (take('{'), take('}')) return true;
    do {
      out.members.emplace_back();
      space();
      if (!string(out.members.back().name) || !take(':') || !value(out.members.back().value, depth + 1)) return false;
    } while (take(','));
    return take('}');
  }
  const std::string &s_;
  size_t i_ = 0;
};

}  // namespace

bool parse_json(const std::string &text, JsonValue &out, size_t *where) {
  Reader reader(text);
  const bool good = reader.value(out, 0) && reader.end();
  if (where) *where = reader.at();
  return good;
}

}  // namespace cli
