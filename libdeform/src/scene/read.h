// Scene tree -> Definition. Every key is checked: name, type, range, references to other names.
#pragma once
#include <algorithm>

#include "math/turn.h"
#include "scene/defs.h"
#include "scene/node.h"

namespace dfm::scene {

struct ReadContext {
  const Registry &types;
  std::vector<std::string> materials;  // keys so far
  std::vector<std::string> sides;      // bodies and obstacles
  std::vector<std::string> bodies{};
  bool planned = false;  // the planner chooses models that are not named
};

Definition read_scene(json &tree, const std::string &file, const Registry &types);

// Parts that more than one file needs.
uint32_t read_count(const Node &node, double least, double most);  // a whole number
Params read_params(const Node &params, const dfm_type *type);
std::vector<double> read_param(const Node &value, const dfm_param &row);
const dfm_type *read_type(const Node &name, uint32_t kind, const Registry &types);
int32_t integrator_of(const Node &holder);  // its key `integrator`, DFM_INTEGRATOR_*
dfm_sine read_sine(const Node &sine, bool scalar);
void check_rising(const Node &key, double previous, double t);
// The key "keyframes", with times that rise; read(node, key) reads all but the time. some: an empty list is
// refused.
template <class Key, class Read>
std::vector<Key> read_keyframes(const Node &holder, const char *kind, Read read, bool some = true) {
  std::vector<Key> keys;
  for (const Node &node : holder.items("keyframes")) {
    node.object(kind);
    Key key = {};
    key.t = node.at("t").number();
    read(node, key);
    if (!keys.empty()) check_rising(node, keys.back().t, key.t);
    keys.push_back(key);
  }
  if (some && keys.empty() && holder.has("keyframes"))
    holder.at("keyframes").fail("expected at least one keyframe");
  return keys;
}
void read_direction(const Node &node, const char *what, double out[3]);  // not zero
void read_sizes(const Node &node, const char *what, double out[3]);      // above 0; what: "half sizes"
// Name, id, material, sensor.
void read_thing(const Node &node, ReadContext &context, Thing &out);
inline bool listed(const std::vector<std::string> &list, const std::string &name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}
void check_fresh(const Node &name, const std::string &value, const std::vector<std::string> &taken,
                 const char *what);
std::string known(const Node &name, const std::vector<std::string> &valid, const char *what);
// Fields, materials by group, anisotropy, surface and filling of a body. read_carriers.cpp
void read_carriers(const Node &body, const dfm_type *model, ReadContext &context, Body &out);
Body read_body(const Node &node, ReadContext &context);
Obstacle read_obstacle(const Node &node, ReadContext &context);
// A key that belongs to some of the words which say what its holder is.
struct KeyOf {
  const char *key;
  std::vector<std::string> words;
};
// Refuses keys of other words; what: "the shape".
void check_keys_of(const Node &node, const std::vector<KeyOf> &keys, const char *what,
                   const std::string &word);
// Size and pose of a shape, for obstacles and rigid bodies; kind: of the pose's object.
void check_shape_keys(const Node &node, const std::string &shape);
dfm_pose read_pose(const Node &holder, const char *kind, double *scale);
// Reads a "start"; missing keys keep their usual values.
dfm_pose read_placed(const Node &start, const dfm_pose &otherwise, Quat turn = {});
uint64_t read_id(const Node &node);  // 0: none is given
template <class Def>                 // dfm_obstacle_def, dfm_rigid_def
void read_solid(const Node &node, const std::string &shape, Def &def);
Rigid read_rigid(const Node &scene, ReadContext &context);
// A key that leaves out position or rotation keeps that of `base`. `turn`: what every rotation is applied to
// (a plane's normal).
std::vector<dfm_pose_key> read_keys(const Node &motion, const dfm_pose &base, Quat turn = {});
Tool read_tool(const Node &node, ReadContext &context);
Cut read_cut(const Node &node, const ReadContext &context, double start);

}  // namespace dfm::scene
