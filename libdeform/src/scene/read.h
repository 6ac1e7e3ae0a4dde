// Scene tree -> Definition. Every key is checked: name, type, range, references to other names.
#pragma once
#include "scene/defs.h"
#include "scene/node.h"

namespace dfm::scene {

struct ReadContext {
  const Types &types;
  std::vector<std::string> materials, titles;  // keys so far, and names for the sides of rules
  std::vector<std::string> sides;              // bodies and obstacles
  std::vector<std::string> bodies{};
  bool planned = false;  // the planner chooses models that are not named
};

Definition read_scene(json &tree, const std::string &file, const Types &types);

// Parts that more than one file needs.
uint32_t read_count(const Node &node, double least, double most);  // a whole number
Params read_params(const Node &params, const dfm_type *type);
std::vector<double> read_param(const Node &value, const dfm_param &row);
const dfm_type *read_type(const Node &name, uint32_t kind, const Types &types);
int32_t integrator_of(const Node &holder);  // its key `integrator`, DFM_INTEGRATOR_*
dfm_sine read_sine(const Node &sine, bool scalar);
void check_rising(const Node &keys, size_t i, double previous, double t);
void check_fresh(const Node &name, const std::string &value, const std::vector<std::string> &taken,
                 const char *what);
std::string known(const Node &name, const std::vector<std::string> &valid, const char *what);
// Fields, materials by group, anisotropy, surface and filling of a body. read_carriers.cpp
void read_carriers(const Node &body, const dfm_type *model, ReadContext &context, Body &out);
std::vector<Body> read_bodies(const Node &scene, ReadContext &context);
std::vector<Obstacle> read_obstacles(const Node &scene, ReadContext &context);
// Size and pose of a shape, for obstacles and rigid bodies; kind: of the pose's object.
void check_shape_keys(const Node &node, const std::string &shape);
dfm_pose read_pose(const Node &holder, const char *kind, double *scale);
// Reads a "start"; missing keys keep their usual values.
dfm_pose read_placed(const Node &start, const dfm_pose &otherwise);
uint64_t read_id(const Node &node);  // 0: none is given
void read_solid(const Node &node, const std::string &shape, uint32_t &number, double half_size[3],
                double &radius, double &half_length);
Rigid read_rigid(const Node &scene, ReadContext &context);
std::vector<dfm_pose_key> read_keys(const Node &motion, const dfm_pose &base);
std::vector<Tool> read_tools(const Node &scene, ReadContext &context);
std::vector<Cut> read_cuts(const Node &scene, const ReadContext &context, const Definition &def);

}  // namespace dfm::scene
