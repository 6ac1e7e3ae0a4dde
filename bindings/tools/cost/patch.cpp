#include "study.h"

#include <algorithm>
#include <filesystem>

#include "cli.h"
#include "file.h"

namespace fs = std::filesystem;

namespace cli::cost {
namespace {

JsonValue patched(const Subject &subject, const Study &study) {
  JsonValue scene = subject.scene;
  for (const auto &[pointer, text] : own_settings(study.rows[size_t(study.pick)])) {
    JsonValue value;
    if (parse_json(text, value)) set_pointer(scene, pointer, value);
  }
  return scene;
}

JsonValue difference(const JsonValue &from, const JsonValue &to) {
  JsonValue out;
  out.kind = JsonValue::object;
  for (const JsonMember &m : to.members) {
    const JsonValue *const before = from.find(m.name);
    if (before && json_text(*before) == json_text(m.value)) continue;
    const bool objects = before && before->kind == JsonValue::object && m.value.kind == JsonValue::object;
    out.members.push_back({m.name, objects ? difference(*before, m.value) : m.value});
  }
  for (const JsonMember &m : from.members)  // null: is taken away
    if (!to.find(m.name)) out.members.push_back({m.name, {}});
  return out;
}

}  // namespace

Settings own_settings(const Row &row) {
  Settings out = row.job.set;
  std::erase_if(out, [](auto &s) { return s.first.rfind("/output/", 0) == 0 || s.first == "/probes"; });
  return out;
}

Settings settings_of_file(const Subject &subject, const Row &row) {
  const Settings own = own_settings(row);
  if (own.empty()) return {};
  Settings out = subject.planned;
  std::erase_if(
      out, [&](auto &s) { return std::ranges::any_of(own, [&](auto &o) { return o.first == s.first; }); });
  out.insert(out.end(), own.begin(), own.end());
  return out;
}

JsonValue scene_patch(const Subject &subject, const Study &study) {
  if (study.pick < 0) return {};
  return difference(subject.given, patched(subject, study));
}

void write_applied(const Subject &subject, const Study &study, const std::string &path) {
  JsonValue scene = patched(subject, study);
  std::error_code error;
  fs::create_directories(fs::absolute(path).parent_path(), error);
  const fs::path folder = fs::weakly_canonical(fs::absolute(path).parent_path());
  for (const std::string &pointer : file_pointers(scene)) {
    JsonValue name = *at_pointer(scene, pointer);
    if (fs::path(name.text).is_absolute()) continue;
    // canonical, since .. behind a symbolic link leads elsewhere
    const fs::path file = fs::absolute(fs::path(subject.folder) / name.text);
    const fs::path from = fs::weakly_canonical(file.parent_path());  // a linked file keeps its own name
    name.text = (from / file.filename()).lexically_relative(folder).generic_string();
    set_pointer(scene, pointer, name);
  }
  write_whole(path, json_lines(scene));
}

}  // namespace cli::cost
