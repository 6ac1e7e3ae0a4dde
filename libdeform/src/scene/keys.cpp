#include "scene/keys.h"

#include <stdexcept>

namespace dfm::scene {
namespace {

using Table = std::vector<std::pair<std::string, std::vector<Key>>>;

const Table &objects() {
  static const Table table = {
      {"scene",
       {{"format", true},
        {"version", true},
        {"gravity", true},
        {"time", true},
        {"effects", true},
        {"accuracy", true},
        {"budget", true},
        {"materials", true},
        {"bodies", true},
        {"obstacles", true},
        {"rigid", true},
        {"contact", true},
        {"solver", true},
        {"probes", true},
        {"output", true}}},
      {"solver", {{"type", true}, {"tolerance", true}, {"max_iterations", true}, {"newton", true}}},
      {"accuracy", {{"target", true}, {"quantity", true}}},
      {"budget", {{"ms_per_step", true}}},
      {"gravity", {{"keyframes", true}}},
      {"gravity_key", {{"t", true}, {"value", true}}},
      {"time",
       {{"start", true},
        {"duration", true},
        {"step", true},
        {"integrator", true},
        {"max_time", true},
        {"max_work", true},
        {"mode", true}}},
      // A material may hold, beside these, any parameter of a loaded model.
      {"material",
       {{"name", true},
        {"density", true},
        {"young", true},
        {"poisson", true},
        {"damping", true},
        {"friction", true}}},
      {"damping", {{"mass", true}, {"stiffness", true}}},
      {"body", {{"name", true},       {"mesh", true},    {"material", true},   {"model", true},
                {"integrator", true}, {"pose", true},    {"velocity", true},   {"spin", true},
                {"fix", true},        {"forces", true},  {"surface", true},    {"nodal_bc", true},
                {"fill", true},       {"springs", true}, {"anisotropy", true}, {"materials_by_group", true},
                {"fields", true},     {"start", true},   {"switch", true},     {"attach", true},
                {"sensor", true},     {"id", true},      {"pressure", false}}},
      {"model", {{"type", true}, {"params", true}, {"precision", true}}},
      {"switch_rule",
       {{"touching", true},
        {"near", true},
        {"far", true},
        {"point", true},
        {"distance", true},
        {"hysteresis", true},
        {"wait", true},
        {"max_jump", true}}},
      {"switch_model", {{"type", true}, {"params", true}, {"precision", true}, {"integrator", true}}},
      {"switch",
       {{"t", true},
        {"type", true},
        {"params", true},
        {"precision", true},
        {"integrator", true},
        {"max_jump", true}}},
      {"pose", {{"position", true}, {"rotation", true}, {"scale", true}}},
      {"rotation", {{"axis", true}, {"angle_deg", true}, {"quaternion", true}}},
      {"fix", {{"box", true}, {"group", true}, {"points", true}, {"axes", true}, {"motion", true}}},
      {"force",
       {{"box", true},
        {"group", true},
        {"points", true},
        {"total", true},
        {"by", true},
        {"keyframes", true},
        {"sine", true}}},
      {"spring",
       {{"box", true},
        {"group", true},
        {"points", true},
        {"point", true},
        {"to", true},
        {"keyframes", true},
        {"stiffness", true},
        {"damping", true}}},
      {"attach",
       {{"to", true},
        {"box", true},
        {"group", true},
        {"points", true},
        {"max_distance", true},
        {"stiffness", true},
        {"damping", true},
        {"release", true},
        {"touch", true}}},
      {"spring_key", {{"t", true}, {"position", true}}},
      {"force_key", {{"t", true}, {"scale", true}}},
      {"motion", {{"keyframes", true}, {"sine", true}}},
      {"motion_key", {{"t", true}, {"position", true}, {"rotation", true}}},
      {"sine", {{"amplitude", true}, {"frequency", true}, {"phase", true}}},
      {"surface", {{"from", true}, {"mesh", true}, {"coupling", true}, {"support", true}}},
      {"made_mesh",
       {{"make", true},
        {"radius", true},
        {"inner", true},
        {"length", true},
        {"size", true},
        {"cells", true}}},
      {"fill", {{"cells", true}}},
      {"start", {{"scramble", true}, {"flatten", true}, {"invert", true}, {"state", true}}},
      {"anisotropy", {{"axis", true}, {"field", true}, {"params", true}}},
      {"obstacle",
       {{"name", true},
        {"shape", true},
        {"point", true},
        {"normal", true},
        {"radius", true},
        {"half_size", true},
        {"half_length", true},
        {"pose", true},
        {"motion", true},
        {"velocity_surface", true},
        {"material", true},
        {"sensor", true},
        {"start", true},
        {"id", true},
        {"mesh", true},
        {"cells", true}}},
      {"obstacle_pose", {{"position", true}, {"rotation", true}, {"scale", true}}},
      {"rigid", {{"host", true}, {"bodies", true}}},
      {"rigid_body",
       {{"name", true},
        {"shape", true},
        {"radius", true},
        {"half_size", true},
        {"half_length", true},
        {"mass", true},
        {"inertia", true},
        {"pose", true},
        {"velocity", true},
        {"spin", true},
        {"fixed", true},
        {"joints", true},
        {"material", true},
        {"sensor", true},
        {"start", true},
        {"id", true}}},
      {"rigid_start", {{"position", true}, {"rotation", true}, {"velocity", true}, {"spin", true}}},
      {"rigid_pose", {{"position", true}, {"rotation", true}}},
      {"obstacle_start", {{"position", true}, {"rotation", true}}},
      {"joint", {{"type", true}, {"with", true}, {"anchor", true}, {"axis", true}, {"motor", true}}},
      {"motor", {{"velocity", true}, {"max", true}}},
      {"contact",
       {{"method", true},
        {"self", true},
        {"untangle", true},
        {"sleep", true},
        {"tolerance", true},
        {"offset", true},
        {"guard", true},
        {"energy_watch", true},
        {"recovery_speed", true},
        {"obstacle_speed", true},
        {"friction", true},
        {"filter", true}}},
      {"friction", {{"between", true}, {"law", true}, {"params", true}}},
      {"filter", {{"between", true}, {"collide", true}}},
      {"probe", {{"name", true}, {"body", true}, {"point", true}}},
      {"output",
       {{"every", true},
        {"frames", true},
        {"states", true},
        {"nodes", true},
        {"contacts", true},
        {"check", true},
        {"camera", true},
        {"color", true}}},
      {"camera", {{"eye", true}, {"look_at", true}}},
  };
  return table;
}

const Table &words() {
  static const Table table = {
      {"mode", {{"dynamic", true}, {"static", true}}},
      {"integrator",
       {{"auto", true},
        {"symplectic_euler", true},
        {"verlet", false},
        {"implicit_euler", true},
        {"tr_bdf2", true}}},
      {"method", {{"auto", true}, {"velocity", true}, {"implicit", true}, {"rollback", true}}},
      {"shape",
       {{"plane", true},
        {"sphere", true},
        {"box", true},
        {"capsule", true},
        {"mesh", true},
        {"voxels", true}}},
      {"rigid_shape",
       {{"sphere", true}, {"box", true}, {"capsule", true}, {"mesh", false}, {"voxels", false}}},
      {"joint_type", {{"hinge", true}, {"slider", true}, {"ball", true}, {"fixed", true}}},
      {"make", {{"beam", true}, {"cylinder", true}, {"ball", true}, {"tube", true}}},
      {"from", {{"boundary", true}}},
      {"flatten", {{"plane", true}, {"line", true}, {"point", true}}},
      {"precision", {{"double", true}, {"single", true}}},
      {"coupling", {{"barycentric", true}, {"mls", true}, {"thesis", true}}},
      {"by", {{"auto", true}, {"area", true}, {"mass", true}}},
      {"color",
       {{"body", true}, {"contact", true}, {"speed", true}, {"displacement", true}, {"stress", true}}},
  };
  return table;
}

const std::vector<Key> &find(const Table &table, const std::string &name) {
  for (const auto &[key, rows] : table)
    if (key == name) return rows;
  throw std::logic_error("no such table in scene/keys: " + name);
}

std::vector<std::string> names(const Table &table) {
  std::vector<std::string> out;
  for (const auto &row : table) out.push_back(row.first);
  return out;
}

}  // namespace

const std::vector<Key> &keys_of(const std::string &kind) { return find(objects(), kind); }
const std::vector<Key> &words_of(const std::string &what) { return find(words(), what); }

const std::vector<std::string> &object_kinds() {
  static const std::vector<std::string> list = names(objects());
  return list;
}

const std::vector<std::string> &word_sets() {
  static const std::vector<std::string> list = names(words());
  return list;
}

}  // namespace dfm::scene
