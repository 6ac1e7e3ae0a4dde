#include "label_table.h"

#include <algorithm>
#include <set>

#include "file.h"
#include "messages.h"
#include "shown.h"

namespace labels {
namespace {

using cli::JsonMember;
using cli::JsonValue;

constexpr uint64_t kMaxBytes = 16 << 20;
constexpr uint32_t kMaxCells = 5000000;
constexpr size_t kMaxName = 60;  // bytes

// For names of files, bodies and groups alike.
std::string plain_name(const std::string &name) {
  std::string out;
  for (const char c : cli::shown(cli::as_utf8(name))) {  // without control characters
    const bool goes_on = (c & 0xc0) == 0x80;             // a character of several bytes
    if (out.size() >= kMaxName && !goes_on) break;
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       (c & 0x80) != 0 || c == '_' || c == '-' || (c == '.' && !out.empty());
    out += plain ? c : '_';
  }
  return out;
}

std::string escaped(const std::string &key) {  // of a JSON pointer
  std::string out;
  for (const char c : key) out += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return out;
}

class Reader {
 public:
  Reader(const std::string &path, const Volume &volume) : path_(path), volume_(volume) {}

  Table read() {
    const std::string text = cli::read_file(path_, kMaxBytes, "a table of labels");
    JsonValue root;
    size_t where = 0;
    std::string why;
    if (!cli::parse_json(text, root, &where, &why))
      refuse(path_ + ":" + std::to_string(1 + std::count(text.begin(), text.begin() + long(where), '\n')),
             "%s", why.c_str());
    need_object(root, "");
    known(root, "", {"format", "version", "labels", "materials", "bodies", "scene"});
    if (root.get("format") != "deform-labels")
      refuse(path_, "/format: expected \"deform-labels\", found %s", quoted_part(root.get("format")).c_str());
    if (root.get("version") != "1")
      refuse(path_, "/version: expected 1, found %s", quoted_part(root.get("version")).c_str());
    out_.materials.kind = JsonValue::object;
    if (const JsonValue *m = root.find("materials")) {
      need_object(*m, "/materials");
      out_.materials = *m;
    }
    if (const JsonValue *s = root.find("scene")) {
      need_object(*s, "/scene");
      for (const JsonMember &key : s->members)
        for (const char *ours : {"format", "version", "materials", "bodies"})
          if (key.name == ours) refuse(path_, "/scene/%s: is written from the labels; remove it here", ours);
      need_list(*s, "obstacles", "/scene");
      if (const JsonValue *contact = s->find("contact")) {
        need_object(*contact, "/scene/contact");
        need_list(*contact, "filter", "/scene/contact");
      }
      out_.scene = *s;
    }
    const JsonValue *list = root.find("labels");
    if (!list) refuse(path_, "has no \"labels\"; list them as {\"1\": {\"name\": \"liver\"}}");
    need_object(*list, "/labels");
    labels(*list);
    if (const JsonValue *bodies = root.find("bodies")) {
      need_object(*bodies, "/bodies");
      for (const JsonMember &b : bodies->members) body(b);
    }
    return std::move(out_);
  }

 private:
  void need_object(const JsonValue &v, const std::string &pointer) const {
    if (v.kind != JsonValue::object)
      refuse(path_, "%s: expected an object, {...}", pointer.empty() ? "the file" : pointer.c_str());
  }
  void need_list(const JsonValue &v, const char *key, const std::string &pointer) const {
    const JsonValue *m = v.find(key);
    if (m && m->kind != JsonValue::array)
      refuse(path_, "%s/%s: expected a list, [...]", pointer.c_str(), key);
  }
  void known(const JsonValue &v, const std::string &pointer, const std::vector<std::string> &keys) const {
    for (const JsonMember &m : v.members) {
      if (std::ranges::find(keys, m.name) != keys.end()) continue;
      refuse(path_, "%s/%s: no such key%s", pointer.c_str(), escaped(m.name).c_str(),
             cli::did_you_mean(m.name, keys).c_str());
    }
  }
  std::string text(const JsonValue &v, const char *key, const std::string &pointer) const {
    const JsonValue *m = v.find(key);
    if (!m) return "";
    if (m->kind != JsonValue::string || m->text.empty())
      refuse(path_, "%s/%s: expected a name in quotes", pointer.c_str(), key);
    return m->text;
  }
  bool truth(const JsonValue &v, const char *key, const std::string &pointer) const {
    const JsonValue *m = v.find(key);
    if (!m) return false;
    if (m->kind != JsonValue::literal || (m->text != "true" && m->text != "false"))
      refuse(path_, "%s/%s: expected true or false", pointer.c_str(), key);
    return m->text == "true";
  }

  std::string all_labels() const {
    std::string out;
    for (size_t i = 1; i < volume_.value.size() && i <= 20; ++i)
      out += (i > 1 ? ", " : "") + std::to_string(volume_.value[i]);
    return out + (volume_.value.size() > 21 ? ", ..." : "");
  }

  void labels(const JsonValue &list) {
    std::map<int64_t, const JsonMember *> sorted;
    for (const JsonMember &m : list.members) {
      int64_t value = 0;
      const std::string pointer = "/labels/" + escaped(m.name);
      if (!to_number(m.name, value))
        refuse(path_, "%s: expected the number of a label as key", pointer.c_str());
      if (value == 0) refuse(path_, "%s: 0 is the background and becomes nothing", pointer.c_str());
      if (!std::binary_search(volume_.value.begin() + 1, volume_.value.end(), value))
        refuse(path_, "%s: the volume has no label %lld; it has %s", pointer.c_str(),
               static_cast<long long>(value), all_labels().c_str());
      if (!sorted.emplace(value, &m).second) refuse(path_, "%s: the label is listed twice", pointer.c_str());
    }
    for (const auto &[value, member] : sorted) label(value, *member);
    for (size_t i = 1; i < volume_.value.size(); ++i)
      if (!sorted.count(volume_.value[i]))
        out_.warnings.push_back("label " + std::to_string(volume_.value[i]) + " is not in " + path_ +
                                " and is left out, as background");
    if (out_.entries.empty())
      refuse(path_, "/labels: no label is left to make anything of; the volume has %s", all_labels().c_str());
  }

  void label(int64_t value, const JsonMember &m) {
    const std::string pointer = "/labels/" + escaped(m.name);
    need_object(m.value, pointer);
    known(m.value, pointer, {"name", "body", "material", "obstacle", "skip"});
    if (truth(m.value, "skip", pointer)) return;
    Entry e;
    e.label = uint16_t(std::lower_bound(volume_.value.begin() + 1, volume_.value.end(), value) -
                       volume_.value.begin());
    const auto named = volume_.name.find(value);
    e.name = text(m.value, "name", pointer);
    if (e.name.empty())
      e.name = named != volume_.name.end() ? named->second : "label_" + std::to_string(value);
    const bool obstacle = truth(m.value, "obstacle", pointer);
    std::string thing = text(m.value, "body", pointer);
    if (obstacle && !thing.empty())
      refuse(path_, "%s/body: an obstacle is no part of a body; remove \"body\" or \"obstacle\"",
             pointer.c_str());
    const std::string given = thing.empty() ? e.name : thing;
    thing = plain_name(given);
    e.name = plain_name(e.name);
    e.material = text(m.value, "material", pointer);
    if (!obstacle && e.material.empty())
      refuse(path_,
             "%s: \"material\" is missing; name one of /materials, or say \"obstacle\": true or "
             "\"skip\": true",
             pointer.c_str());
    if (!e.material.empty() && !out_.materials.find(e.material)) {
      std::vector<std::string> names;
      for (const JsonMember &k : out_.materials.members) names.push_back(k.name);
      refuse(path_, "%s/material: /materials has no \"%s\"%s", pointer.c_str(), e.material.c_str(),
             cli::did_you_mean(e.material, names).c_str());
    }
    for (const Entry &other : out_.entries)
      if (other.name == e.name)
        refuse(path_, "%s/name: label %lld has the name %s already; give another one", pointer.c_str(),
               static_cast<long long>(volume_.value[other.label]), e.name.c_str());
    size_t t = 0;
    while (t < out_.things.size() && out_.things[t].name != thing) ++t;
    if (t == out_.things.size()) {
      out_.things.emplace_back();
      out_.things[t].name = thing;
      out_.things[t].obstacle = obstacle;
      given_.push_back(given);
    } else if (given_[t] != given) {
      refuse(path_, "%s: \"%s\" and \"%s\" would both be called %s; give other names", pointer.c_str(),
             given_[t].c_str(), given.c_str(), thing.c_str());
    } else if (obstacle || out_.things[t].obstacle) {
      refuse(path_, "%s: another label is the body or obstacle %s already; give it another name",
             pointer.c_str(), thing.c_str());
    }
    e.thing = t;
    out_.things[t].entries.push_back(out_.entries.size());
    out_.entries.push_back(e);
  }

  void body(const JsonMember &m) {
    const std::string pointer = "/bodies/" + escaped(m.name);
    need_object(m.value, pointer);
    for (const char *key : {"fix", "attach"}) need_list(m.value, key, pointer);
    std::vector<std::string> names;
    for (Thing &t : out_.things) {
      if (t.obstacle) continue;
      names.push_back(t.name);
      if (t.name != m.name) continue;
      t.more = m.value;
      for (size_t i = 0; i < t.more.members.size(); ++i) {
        const JsonMember &key = t.more.members[i];
        for (const char *ours : {"name", "mesh", "material", "materials_by_group", "fill"})
          if (key.name == ours)
            refuse(path_, "%s/%s: is written from the labels; remove it here", pointer.c_str(), ours);
        if (key.name == "surface") {
          if (key.value.members.size() != 1 || key.value.get("from") != "boundary")
            refuse(path_,
                   "%s/surface: expected {\"from\": \"boundary\"}, for a body that is cut or torn; any other "
                   "surface is written from the labels: remove it here",
                   pointer.c_str());
          t.own_boundary = true;
          t.more.members.erase(t.more.members.begin() + long(i--));
          continue;
        }
        if (key.name != "cells") continue;
        int64_t cells = 0;
        if (!to_number(key.value.text, cells) || cells < 1 || cells > kMaxCells)
          refuse(path_, "%s/cells: expected a whole number from 1 to %u", pointer.c_str(), kMaxCells);
        t.cells = uint32_t(cells);
        t.more.members.erase(t.more.members.begin() + long(i--));
      }
      return;
    }
    refuse(path_, "%s: no label is a part of the body \"%s\"%s", pointer.c_str(), m.name.c_str(),
           cli::did_you_mean(m.name, names).c_str());
  }

  const std::string &path_;
  const Volume &volume_;
  Table out_;
  std::vector<std::string> given_;  // names of out_.things as the file has them
};

}  // namespace

Table read_table(const std::string &path, const Volume &volume) { return Reader(path, volume).read(); }

std::vector<std::array<uint16_t, 2>> touching_labels(const Volume &v) {
  std::set<std::array<uint16_t, 2>> found;
  const size_t steps[3] = {1, v.size[0], size_t(v.size[0]) * v.size[1]};
  size_t at = 0;
  for (uint32_t k = 0; k < v.size[2]; ++k)
    for (uint32_t j = 0; j < v.size[1]; ++j)
      for (uint32_t i = 0; i < v.size[0]; ++i, ++at) {
        const uint32_t c[3] = {i, j, k};
        for (size_t a = 0; a < 3; ++a) {
          if (c[a] + 1 == v.size[a]) continue;
          const uint16_t own = v.voxel[at], next = v.voxel[at + steps[a]];
          if (own != next && own != 0 && next != 0) found.insert({std::min(own, next), std::max(own, next)});
        }
      }
  return {found.begin(), found.end()};
}

Table default_table(const Volume &v, const std::vector<std::array<uint16_t, 2>> &touch) {
  Table out;
  cli::parse_json(
      "{\"tissue\": {\"density\": 1000, \"young\": 1e4, \"poisson\": 0.4, "
      "\"damping\": {\"mass\": 1, \"stiffness\": 0.005}}}",
      out.materials);
  std::vector<uint16_t> first(v.value.size());
  for (size_t i = 0; i < first.size(); ++i) first[i] = uint16_t(i);
  bool changed = true;
  while (changed) {
    changed = false;
    for (const auto &[a, b] : touch) {
      const uint16_t least = std::min(first[a], first[b]);
      changed = changed || first[a] != least || first[b] != least;
      first[a] = first[b] = least;
    }
  }
  std::set<std::string> names;
  for (size_t i = 1; i < v.value.size(); ++i) {
    Entry e;
    e.label = uint16_t(i);
    const auto named = v.name.find(v.value[i]);
    if (named != v.name.end()) e.name = plain_name(named->second);
    if (e.name.empty() || !names.insert(e.name).second) {
      e.name = "label_" + std::to_string(v.value[i]);
      while (!names.insert(e.name).second) e.name += '_';  // the file gives it to another one
    }
    e.material = "tissue";
    size_t t = 0;
    while (t < out.things.size() && out.entries[out.things[t].entries[0]].label != first[i]) ++t;
    if (t == out.things.size()) {
      out.things.emplace_back();
      out.things[t].name = e.name;
    }
    e.thing = t;
    out.things[t].entries.push_back(out.entries.size());
    out.entries.push_back(e);
  }
  // what has several labels is not called like one of them
  uint32_t n = 0;
  for (Thing &t : out.things) {
    if (t.entries.size() < 2) continue;
    do t.name = ++n == 1 ? "body" : "body_" + std::to_string(n);
    while (names.count(t.name));
  }
  return out;
}

std::string table_text(const Table &table, const Volume &volume) {
  cli::JsonObject labels, bodies, out;
  for (const Entry &e : table.entries) {
    const Thing &t = table.things[e.thing];
    cli::JsonObject entry;
    entry.add("name", cli::quoted(e.name));
    if (t.obstacle) entry.add("obstacle", "true");
    else if (t.name != e.name) entry.add("body", cli::quoted(t.name));
    if (!e.material.empty()) entry.add("material", cli::quoted(e.material));
    labels.add(std::to_string(volume.value[e.label]), entry.text());
  }
  for (const Thing &t : table.things) {
    if (t.obstacle || (t.cells == 0 && !t.own_boundary && t.more.members.empty())) continue;
    cli::JsonObject body;
    if (t.own_boundary) body.add("surface", "{\"from\": \"boundary\"}");
    if (t.cells) body.add("cells", t.cells);
    for (const JsonMember &m : t.more.members) body.add(m.name, cli::json_text(m.value));
    bodies.add(t.name, body.text());
  }
  out.add("format", "\"deform-labels\"", "version", "1", "labels", labels.text(), "materials",
          cli::json_text(table.materials));
  if (bodies.text() != "{}") out.add("bodies", bodies.text());
  if (table.scene.kind == JsonValue::object) out.add("scene", cli::json_text(table.scene));
  JsonValue whole;
  cli::parse_json(out.text(), whole);
  return cli::json_lines(whole);
}

}  // namespace labels
