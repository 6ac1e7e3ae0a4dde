// A line of JSON that says what the state belongs to, then the bytes of dfm_world_snapshot. These alone, as
// dfm_world_write_scene leaves them, are read too.
#include "state_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>

#include "file.h"
#include "json_text.h"
#include "messages.h"
#include "system.h"

namespace cli {
namespace {

constexpr uint64_t kMaxState = uint64_t{1} << 33;  // bytes
constexpr const char *kFormat = "deform-state", *kVersion = "1";
constexpr const char *kSnapshot = "dfmsnap";  // how the bytes of dfm_world_snapshot begin

// Versions of the plugins that are loaded, by id.
std::map<std::string, std::string> versions(const SceneFile &scene) {
  std::map<std::string, std::string> out;
  need(dfm_plugin_visit(
      scene.context(),
      [](void *user, const dfm_type *type, const char *) {
        (*static_cast<std::map<std::string, std::string> *>(user))[type->id] =
            type->version ? type->version : "";
      },
      &out));
  return out;
}

// What the world's later steps call: its laws, the models that its bodies have or may change to, the solver.
std::set<std::string> called(const SceneFile &scene) {
  JsonValue plan;
  if (!parse_json(scene.explain(), plan))
    throw Failure(kBadInput, scene.path() + ": its plan cannot be read");
  std::set<std::string> out;
  for (const JsonValue &law : plan.list("laws")) out.insert(law.get("name"));
  for (const JsonValue &body : plan.list("bodies")) {
    out.insert(body.get("model"));
    for (const JsonValue &change : body.list("changes")) out.insert(change.get("name"));
  }
  JsonValue solver;
  if (parse_json(scene.value("/solver/type"), solver)) out.insert(solver.text);
  return out;
}

std::vector<std::string> needs_of(const SceneFile &scene) {
  const std::set<std::string> names = called(scene);
  std::vector<std::string> out;
  for (const auto &[id, version] : versions(scene)) {
    if (!names.count(id) && !names.count(id.substr(id.find_last_of('.') + 1))) continue;
    out.push_back(json_object("id", quoted(id), "version", quoted(version)));
  }
  return out;
}

// What moves bodies whose scene says "device": "'cube' is on gpu".
std::string devices_of(const SceneFile &scene) {
  JsonValue devices;
  const std::string json = scene.value("/devices");
  if (json.empty() || !parse_json(json, devices)) return "";
  std::string out;
  for (const JsonValue &d : devices.items)
    out += (out.empty() ? "'" : ", '") + d.get("name") + "' is on " + d.get("device");
  return out;
}

std::string head_of(const SceneFile &scene, size_t bytes) {
  return json_object("format", quoted(kFormat), "version", kVersion, "library",
                     quoted(dfm_version(nullptr, nullptr, nullptr)), "scene",
                     quoted(hash_text(scene_hash(scene))), "devices", quoted(devices_of(scene)), "t",
                     dfm_world_time(scene.world()), "state_hash",
                     quoted(hash_text(dfm_world_hash(scene.world()))), "plugins", json_array(needs_of(scene)),
                     "bytes", bytes) +
         "\n";
}

[[noreturn]] void refuse(const std::string &path, const std::string &why) {
  throw Failure(kBadInput, path + ": " + why);
}

// That it was written with what is loaded here. Which build of it that was does not matter: versions differ
// where results do, and the hash of the state is compared afterwards.
void check_versions(const SceneFile &scene, const std::string &path, const JsonValue &head) {
  const std::string library = dfm_version(nullptr, nullptr, nullptr);
  if (head.get("library") != library)
    refuse(path, "written by version " + head.get("library") + " of the library, and this is " + library +
                     "; run the scene again, or use that version");
  const std::map<std::string, std::string> here = versions(scene);
  for (const JsonValue &row : head.list("plugins")) {
    const std::string id = row.get("id"), then = row.get("version");
    const auto now = here.find(id);
    if (now == here.end()) continue;  // where it is needed the restore says so
    if (now->second != then)
      refuse(path, "written with '" + id + "' " + then + ", and " + now->second +
                       " is loaded here; run the scene again, or load that plugin");
  }
}

}  // namespace

std::string hash_text(uint64_t hash) {
  char text[24];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

uint64_t hash_of(const std::string &bytes) {
  uint64_t hash = 14695981039346656037u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash;
}

uint64_t scene_hash(const SceneFile &scene) {
  JsonValue text;
  if (!parse_json(scene.value(""), text)) throw Failure(kBadInput, scene.path() + ": no scene to hash");
  const auto erase = [](JsonValue &from, const char *name) {
    std::erase_if(from.members, [&](const JsonMember &m) { return m.name == name; });
  };
  erase(text, "output");
  erase(text, "devices");  // why they were chosen; the bodies have the models
  for (JsonMember &m : text.members)
    if (m.name == "time") erase(m.value, "duration");
  return hash_of(json_text(text));
}

void refuse_static(const SceneFile &scene, const std::string &option) {
  if (scene.value("/time/mode") == "\"static\"")
    throw Failure(kBadInput,
                  option + ": " + scene.path() +
                      " searches equilibria (\"mode\": \"static\"), which have no state to continue "
                      "from; omit the option");
}

void check_scene_path(const SceneFile &scene, const std::string &path) {
  const std::filesystem::path file = path_of(path);
  const auto refuse = [&](const std::string &why) {
    throw Failure(kBadInput, "--save-scene " + path + ": " + why);
  };
  if (file.extension() != ".json" || file.stem().empty())
    refuse("the name of a scene file must end in .json");
  refuse_same("--save-scene", path, scene.path());
  if (!may_write_beside(path)) refuse(std::string("cannot be written there: ") + std::strerror(errno));
  if (std::error_code none; std::filesystem::is_directory(file, none))
    refuse("a folder of that name is there");
}

void check_state_path(const std::string &path) {
  const std::filesystem::path file = path_of(path);
  const auto refuse = [&](const std::string &why) {
    throw Failure(kBadInput, "--save " + path + ": " + why);
  };
  if (!may_write_beside(path)) refuse(std::string("cannot be written there: ") + std::strerror(errno));
  std::error_code none;
  const std::filesystem::file_status there = std::filesystem::status(file, none);
  if (std::filesystem::is_directory(there)) refuse("a folder of that name is there");
  const bool empty = std::filesystem::is_regular_file(there) && std::filesystem::file_size(file, none) == 0;
  if (std::filesystem::exists(there) && !empty &&
      !(std::filesystem::is_regular_file(there) && holds(path, kFormat)))
    refuse("a file that holds no state is there and would be overwritten; give another name");
}

void write_as_scene(const SceneFile &scene, const std::string &path) {
  dfm_scene_write_def def = dfm_scene_write_def_default();
  def.flags = DFM_SCENE_PARTIAL;
  if (scene.value("/time/mode") != "\"static\"") def.flags |= DFM_SCENE_SNAPSHOT;
  def.duration = scene.settings().duration;
  std::string about = path;
  def.user = &about;
  def.note = [](void *user, const char *sentence) {
    warn(*static_cast<const std::string *>(user) + ": " + sentence);
  };
  need(dfm_scene_write(scene.scene(), path.c_str(), &def, nullptr));
}

std::string snapshot_of(dfm_world world) {
  size_t bytes = 0;
  need(dfm_world_snapshot(world, nullptr, &bytes));
  std::string snapshot(bytes, '\0');
  need(dfm_world_snapshot(world, snapshot.data(), &bytes));
  return snapshot;
}

void write_state(const SceneFile &scene, const std::string &path) {
  const std::string snapshot = snapshot_of(scene.world());
  write_whole(path, head_of(scene, snapshot.size()) + snapshot);
}

void read_state(const SceneFile &scene, const std::string &path) {
  const std::string text = read_file(path, kMaxState, "a state file of `deform run --save`");
  if (text.rfind(kSnapshot, 0) == 0) {  // which says itself what it belongs to
    if (dfm_world_restore(scene.world(), text.data(), text.size()) < 0) refuse(path, dfm_last_error());
    return;
  }
  const size_t line = text.find('\n');
  JsonValue head;
  if (line == std::string::npos || line > 1 << 20 || !parse_json(text.substr(0, line), head) ||
      head.get("format") != kFormat)
    refuse(path, "not a state file of `deform run --save` or --record");
  if (head.get("version") != kVersion)
    refuse(path, "state format " + head.get("version") + ", and this command reads " + kVersion +
                     "; run the scene again");
  const std::string then = head.get("devices"), now = devices_of(scene);
  if (!then.empty() && !now.empty() && then != now)
    refuse(path, "written where " + then + ", and here " + now +
                     "; give bodies that \"device\" of then, which \"auto\" chooses by the machine");
  if (head.get("scene") != hash_text(scene_hash(scene)))
    refuse(
        path,
        "belongs to another scene than " + scene.path() +
            " as it is now; give the same scene and --set values (\"output\" and the duration may differ)");
  check_versions(scene, path, head);
  const size_t bytes = text.size() - line - 1;
  if (head.get("bytes") != std::to_string(bytes))
    refuse(path, "cut short or damaged: it says that " + head.get("bytes") + " bytes of state follow, " +
                     std::to_string(bytes) + " do");
  if (dfm_world_restore(scene.world(), text.data() + line + 1, bytes) < 0) refuse(path, dfm_last_error());
  if (head.get("state_hash") != hash_text(dfm_world_hash(scene.world())))
    throw Failure(
        kStopped,
        path +
            ": the restored state has another hash than when it was saved; please report this with the file");
}

}  // namespace cli
