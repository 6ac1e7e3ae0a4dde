#include "study.h"

#include <filesystem>

#include "cli.h"
#include "file.h"

namespace fs = std::filesystem;

namespace cli::cost {
namespace {

// The pick's own settings, without what every run records.
Settings settings_of_pick(const Study &study) {
  Settings out;
  for (const auto &setting : study.rows[size_t(study.pick)].job.set)
    if (setting.first.rfind("/output/", 0) != 0 && setting.first != "/probes") out.push_back(setting);
  return out;
}

JsonValue patched(const Subject &subject, const Study &study) {
  JsonValue scene = subject.scene;
  for (const auto &[pointer, text] : settings_of_pick(study)) {
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
