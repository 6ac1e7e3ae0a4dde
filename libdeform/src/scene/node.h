// A node of the scene's JSON tree with its pointer (RFC 6901), so that every error names file, place and what
// was expected. Optional values are written back with their defaults, so that the tree describes the scene
// that runs.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/error.h"

namespace dfm::scene {

using json = nlohmann::json;

struct Range {
  double lo = -1e300, hi = 1e300;
  bool open_lo = false, open_hi = false;  // an open end does not belong to the range
};
inline constexpr Range kAny{};
inline constexpr Range kPositive{0, 1e300, true, false};
inline constexpr Range kNotNegative{0, 1e300, false, false};

class Node {
 public:
  Node(json *value, std::string pointer, const std::string *file)
      : value_(value), pointer_(std::move(pointer)), file_(file) {}

  const std::string &pointer() const { return pointer_; }
  const std::string &file() const { return *file_; }
  json &value() const { return *value_; }

  [[noreturn]] void fail(const char *format, ...) const DEFORM_PRINTF(2, 3);
  [[noreturn]] void not_yet() const;  // "not available yet: POINTER"

  // Checks that this is an object whose keys are those of `kind`; unknown ones and those not
  // delivered are refused.
  const Node &object(const std::string &kind, const std::vector<std::string> &further = {}) const;
  bool has(const char *key) const { return value_->is_object() && value_->contains(key); }
  // Whether the key has a value: null, as in `--set KEY=null`, is none, and such a key is removed.
  bool has_value(const char *key) const {
    if (has(key) && (*value_)[key].is_null()) value_->erase(key);
    return has(key);
  }
  Node at(const std::string &key) const;                      // an error if absent: the key is required
  Node member(const std::string &key) const;                  // must exist
  Node member(const std::string &key, json otherwise) const;  // the latter where it is absent
  // [x, y, z] where it is absent, and made only there: a filled json array allocates in its destructor, which
  // ends the process where memory is short.
  Node member(const std::string &key, double x, double y, double z) const;
  Node part(const std::string &kind) const;  // the object under the key of its kind's name, made if absent
  std::vector<Node> items() const;           // an error if this is no array
  std::vector<Node> items(const char *key) const;  // empty where the key is absent

  double number(const Range &range = kAny) const;
  double number(const char *key, double otherwise, const Range &range = kAny) const {
    return member(key, otherwise).number(range);
  }
  bool boolean() const;
  bool boolean(const char *key, bool otherwise) const { return member(key, otherwise).boolean(); }
  std::string text() const;
  std::string word(const std::string &set) const;  // one of words_of(set)
  std::string word(const char *key, const char *otherwise, const std::string &set) const {
    return member(key, otherwise).word(set);
  }
  void vector(double out[3]) const;
  void vector(const char *key, double out[3], double x, double y, double z) const {
    member(key, x, y, z).vector(out);
  }
  // A name for a file or a table: no separators, no control characters.
  std::string name() const;
  std::string kind_found() const;  // "number 5", for sentences

 private:
  json *value_;
  std::string pointer_;
  const std::string *file_;
};

std::string escape_pointer(const std::string &key);

// Reads a file into a tree: size, nesting and repeated keys are checked first, with line and column.
json parse_file(const std::string &path);
json parse_text(const std::string &text, const std::string &file);
// "/json/pointer=value"; the value is JSON, or else a bare string. Creates the last step of the pointer
// where it is absent.
void apply_set(json &tree, const std::string &assignment, const std::string &file);

}  // namespace dfm::scene
