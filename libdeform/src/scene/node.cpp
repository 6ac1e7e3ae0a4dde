#include "scene/node.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>

#include "scene/keys.h"

namespace dfm::scene {
namespace {

// The text of the file, shortened for an error message.
std::string excerpt(const json &value) {
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  if (text.size() > 40) text = text.substr(0, 37) + "...";
  return text;
}

std::string span(const Range &r) {
  if (r.lo <= -1e300 && r.hi >= 1e300) return "a finite number";
  if (r.hi >= 1e300) return format("a number %s %g", r.open_lo ? "above" : "of at least", r.lo);
  return format("a number from %.9g%s to %.9g%s", r.lo, r.open_lo ? " (excluded)" : "", r.hi,
                r.open_hi ? " (excluded)" : "");
}

std::vector<std::string> delivered(const std::vector<Key> &keys) {
  std::vector<std::string> out;
  for (const Key &k : keys)
    if (k.delivered) out.push_back(k.name);
  return out;
}

}  // namespace

std::string escape_pointer(const std::string &key) {
  std::string out;
  for (char c : key) {
    if (c == '~') out += "~0";
    else if (c == '/') out += "~1";
    else out += c;
  }
  return out;
}

void Node::fail(const char *text, ...) const {
  va_list args;
  va_start(args, text);
  const std::string line = vformat(text, args);
  va_end(args);
  dfm::fail(DFM_E_ARG, "%s: %s: %s", file_->c_str(), pointer_.empty() ? "/" : pointer_.c_str(), line.c_str());
}

void Node::not_yet() const {
  dfm::fail(DFM_E_UNSUPPORTED, "%s: not available yet: %s", file_->c_str(), pointer_.c_str());
}

std::string Node::kind_found() const {
  return value_->is_null() ? "null" : std::string(value_->type_name()) + " " + excerpt(*value_);
}

const Node &Node::object(const std::string &kind, const std::vector<std::string> &further) const {
  const std::vector<Key> &keys = keys_of(kind);
  if (!value_->is_object()) {
    const bool typed = value_->is_string() &&
                       std::any_of(keys.begin(), keys.end(), [](const Key &k) { return k.name == "type"; });
    fail("expected an object with %s, found %s%s", join(delivered(keys)).c_str(), kind_found().c_str(),
         typed ? ("; write {\"type\": " + excerpt(*value_) + "}").c_str() : "");
  }
  for (auto it = value_->begin(); it != value_->end(); ++it) {
    const Key *known = nullptr;
    for (const Key &k : keys)
      if (it.key() == k.name) known = &k;
    bool extra = false;
    for (const std::string &name : further) extra = extra || name == it.key();
    const Node child(&it.value(), pointer_ + "/" + escape_pointer(it.key()), file_);
    if (known && !known->delivered) child.not_yet();
    if (known || extra) continue;
    std::vector<std::string> valid;
    for (const Key &k : keys) valid.push_back(k.name);
    for (const std::string &name : further) valid.push_back(name);
    const std::string near = nearest(it.key(), valid);
    if (!near.empty()) child.fail("unknown key \"%s\"; did you mean \"%s\"?", it.key().c_str(), near.c_str());
    child.fail("unknown key \"%s\"; expected one of: %s", it.key().c_str(), join(delivered(keys)).c_str());
  }
  return *this;
}

Node Node::part(const std::string &kind) const { return member(kind, json::object()).object(kind); }

Node Node::member(const std::string &key) const {
  return Node(&(*value_)[key], pointer_ + "/" + escape_pointer(key), file_);
}

Node Node::member(const std::string &key, json otherwise) const {
  if (!has(key.c_str())) (*value_)[key] = std::move(otherwise);
  return member(key);
}

Node Node::member(const std::string &key, double x, double y, double z) const {
  return has(key.c_str()) ? member(key) : member(key, json::array({x, y, z}));
}

Node Node::at(const std::string &key) const {
  if (!has(key.c_str())) fail("the key \"%s\" is missing here", key.c_str());
  return member(key);
}

std::vector<Node> Node::items() const {
  if (!value_->is_array()) fail("expected an array, found %s", kind_found().c_str());
  std::vector<Node> out;
  for (size_t i = 0; i < value_->size(); ++i)
    out.emplace_back(&(*value_)[i], pointer_ + "/" + std::to_string(i), file_);
  return out;
}

std::vector<Node> Node::items(const char *key) const {
  if (!has(key)) return {};
  return member(key).items();
}

double Node::number(const Range &range) const {
  if (!value_->is_number()) fail("expected %s, found %s", span(range).c_str(), kind_found().c_str());
  const double x = value_->get<double>();
  const bool low = range.open_lo ? x <= range.lo : x < range.lo;
  const bool high = range.open_hi ? x >= range.hi : x > range.hi;
  if (!std::isfinite(x) || low || high)
    fail("expected %s, found %s", span(range).c_str(), excerpt(*value_).c_str());
  return x;
}

bool Node::boolean() const {
  if (!value_->is_boolean()) fail("expected true or false, found %s", kind_found().c_str());
  return value_->get<bool>();
}

std::string Node::text() const {
  if (!value_->is_string()) fail("expected a string, found %s", kind_found().c_str());
  std::string s = value_->get<std::string>();
  if (s.empty()) fail("expected a string that is not empty");
  if (s.find('\0') != std::string::npos) fail("expected a string without a NUL character");
  return s;
}

std::string Node::word(const std::string &set) const {
  const std::string s = text();
  const std::vector<Key> &keys = words_of(set);
  std::vector<std::string> valid;
  for (const Key &k : keys) {
    valid.push_back(k.name);
    if (s != k.name) continue;
    if (!k.delivered) not_yet();
    return s;
  }
  const std::string near = nearest(s, valid);
  if (!near.empty()) fail("\"%s\" is not known; did you mean \"%s\"?", s.c_str(), near.c_str());
  fail("\"%s\" is not known; expected one of: %s", s.c_str(), join(delivered(keys)).c_str());
}

void Node::vector(double out[3]) const {
  if (!value_->is_array() || value_->size() != 3)
    fail("expected three numbers [x, y, z], found %s", kind_found().c_str());
  const std::vector<Node> parts = items();
  for (int i = 0; i < 3; ++i) out[i] = parts[i].number();
}

std::string Node::name() const {
  const std::string s = text();
  if (s.size() > 100) fail("a name has at most 100 bytes, found %zu", s.size());
  if (s[0] == '.') fail("a name does not begin with a dot, found \"%s\"", s.c_str());
  char plain[1024];
  printable(s.c_str(), plain, sizeof plain);
  if (s != plain || s.find_first_of("/\\,:*=\"") != s.npos)
    fail(
        "a name is UTF-8, and holds no control characters and none of / \\ , : * = \", since it stands in "
        "file names, tables and \"between\"; found %s",
        excerpt(*value_).c_str());
  return s;
}

}  // namespace dfm::scene
