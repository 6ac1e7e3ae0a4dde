// A world as a scene: the file that `deform run` takes, with meshes and states in a folder beside it. What a
// scene cannot say gets a sentence each (SceneWriter::note). A new kind of thing gets a write_* function of
// its own here, called by write_root, and a call of `note` for what it has beyond its keys.
#pragma once
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/error.h"
#include "state/world.h"

namespace dfm::writing {

using Written = nlohmann::ordered_json;

// What a scene has that its world does not know of. Values are JSON text, empty where there is none.
struct Beside {
  std::string probes, output;
  std::vector<std::string> probe_bodies;  // by probe: what has its cell now; empty: nothing
  bool equilibrium = false;               // "time"/"mode" is "static"
};

struct WriteOptions {
  double duration = 1, step = 0;  // s; step 0: "auto"
  bool snapshot = false;          // beside the scene, for `deform run --from`
  bool partial = false;           // what a scene cannot say is left out; else it is refused
  Beside beside;
  std::function<void(const std::string &)> note;
};

// notes: how many sentences there were. Throws Error; the scene file itself is written last, and as a whole.
void write_scene(World &w, const std::string &path, const WriteOptions &options, uint32_t &notes);

// ---- for its parts: write_body.cpp, write_things.cpp, write_tools.cpp ------------------------------------

struct SceneWriter {
  World &w;
  const std::string &path;  // of the scene
  const WriteOptions &options;
  uint32_t &notes;
  struct File {
    std::string name;
    std::function<void(const std::string &path)> write;
  };
  std::vector<File> files{};  // written when it is known that nothing is refused
  std::set<std::string> file_names{};
  std::string first{};  // of the sentences
  Written materials = Written::object();
  std::map<std::string, std::pair<std::string, Written>> material_keys{};  // name and entries by key
  std::set<std::string> model_keys{};                                      // parameters of any loaded model

  void note(const char *text, ...) DEFORM_PRINTF(2, 3);
  void note(const Named &whose, const char *text, ...) DEFORM_PRINTF(3, 4);
  // A remark for the user who runs the scene: refuses nothing, and is not counted.
  void remark(const std::string &sentence) const {
    if (options.note) options.note(sentence);
  }
  // A file beside the scene: the path by which the scene names it.
  std::string file(const std::string &name, std::function<void(const std::string &path)> write);
  // The key of a material; empty: it is that of things without one. Adds it to `materials`.
  std::string material(const Material &m);
  // The material of a thing that has no more of it; without a friction: of a body none of whose cells has it.
  std::string material(const std::string &name, std::optional<double> friction);
  void put_material(Written &out, const Obstacle &of);
  std::string text_file(const std::string &name, std::string text);
  std::string triangles(const std::string &name, const Obstacle &of);  // of a mesh, as a file
  void check_name(const char *kind, const std::string &name) const;  // throws where a scene has no such name
  // Whether the scene has a body or obstacle of that name.
  bool has(const std::string &name) const;
};

Written vector_of(const double *v);
inline Written vector_of(Vec3 v) { return {v.x, v.y, v.z}; }
Written rotation_of(const double *q);   // x y z w
Written pose_of(const dfm_pose &pose);  // null: at the origin, not turned
Written pose_of(const Pose &pose);
void put(Written &out, const char *key, Written value);  // unless it is null
void put_integrator(Written &out, int64_t integrator);   // unless it is left to the library
Written key_of(const dfm_pose_key &key);
Written sine_of(const dfm_sine &sine, bool scalar);
bool moves(const dfm_sine &sine);
// Parameters by key, those that are not at the table's default.
Written params_of(const dfm_type &type, const std::vector<double> &values);
Written value_of(const dfm_param &row, const double *values, uint32_t n);  // n: how many there are
bool same_bits(const void *a, const void *b, size_t bytes);

Written write_body(SceneWriter &to, Body &b);
Written write_obstacle(SceneWriter &to, const Obstacle &o);
Written write_rigid(SceneWriter &to);  // null: there are none
// The one whose shape the scene has under the name of o; null: the scene has nothing of that name.
const Obstacle *shape_in_scene(const World &w, const Obstacle &o);
Written write_tool(SceneWriter &to, const Tool &t);
void write_cuts(SceneWriter &to, const Body &b, Written &out);  // those to come, appended

}  // namespace dfm::writing
