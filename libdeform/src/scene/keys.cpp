#include "scene/keys.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace dfm::scene {
namespace {

// Names in the order in which messages list them. A "-" before one: named in the format, not delivered.
struct Row { const char *of, *names; };

constexpr Row kObjects[] = {
    {"scene",
     "format version gravity time effects accuracy budget materials bodies obstacles rigid tools cuts "
     "contact solver probes output"},
    {"solver", "type tolerance max_iterations newton"},
    {"accuracy", "target quantity"},
    {"budget", "ms_per_step"},
    {"gravity", "keyframes"},
    {"gravity_key", "t value"},
    {"time", "start duration step integrator max_time max_work mode"},
    // A material may hold, beside these, any parameter of a loaded model.
    {"material", "name density young poisson damping friction tear fracture_energy"},
    {"damping", "mass stiffness"},
    {"body",
     "name mesh material model integrator pose velocity spin fix forces surface nodal_bc fill lattice "
     "springs anisotropy materials_by_group fields start switch attach sensor id separate cut_delay place "
     "-pressure mass_scaling smooth device"},
    {"place", "on"},
    {"separate", "least_cells crumbs"},
    {"model", "type params precision"},
    {"switch_rule", "touching near far point distance hysteresis wait max_jump"},
    {"switch_model", "type params precision integrator"},
    {"switch", "t type params precision integrator max_jump"},
    {"pose", "position rotation scale"},
    {"rotation", "axis angle_deg quaternion"},
    {"fix", "box group points axes motion"},
    {"force", "box group points total by keyframes sine"},
    {"spring", "box group points point to keyframes stiffness damping"},
    {"attach", "to box group points max_distance stiffness damping release touch"},
    {"spring_key", "t position"},
    {"force_key", "t scale"},
    {"motion", "keyframes sine"},
    {"motion_key", "t position rotation"},
    {"sine", "amplitude frequency phase"},
    {"surface", "from mesh coupling support"},
    {"made_mesh", "make radius inner length size cells order"},
    {"fill", "cells"},
    {"lattice", "cells size"},
    {"start", "scramble flatten invert state"},
    {"anisotropy", "axis field params"},
    {"obstacle",
     "name shape point normal radius half_size half_length pose motion velocity_surface material sensor "
     "start id mesh cells"},
    {"obstacle_pose", "position rotation scale"},
    {"rigid", "host bodies"},
    {"rigid_body",
     "name shape radius half_size half_length mass inertia pose velocity spin fixed joints material "
     "sensor start id"},
    {"rigid_start", "position rotation velocity spin"},
    {"rigid_pose", "position rotation"},
    {"obstacle_start", "position rotation"},
    {"joint", "type with anchor axis motor"},
    {"motor", "velocity max"},
    {"tool",
     "name shape radius half_size half_length mesh pose motion opening_deg coupling cuts id material"},
    {"tool_cuts", "bodies mode most"},
    {"cut", "body t shape point normal corners radius half_size pose mode most"},
    {"cut_pose", "position rotation"},
    {"tool_motion", "keyframes file"},
    {"opening", "keyframes"},
    {"opening_key", "t value"},
    {"coupling", "stiffness damping turn_stiffness turn_damping mass inertia late passive"},
    {"contact",
     "method self untangle sleep tolerance offset guard energy_watch recovery_speed obstacle_speed "
     "max_sweeps friction filter"},
    {"friction", "between law params restitution"},
    {"filter", "between collide"},
    {"probe", "name body point"},
    {"output", "every frames states nodes contacts check camera color color_range"},
    {"camera", "eye look_at"},
};

// The place of a word is its number in the public headers, where these have one.
constexpr Row kWords[] = {
    {"mode", "dynamic static"},
    {"integrator", "auto symplectic_euler implicit_euler tr_bdf2 -verlet"},
    {"method", "auto velocity implicit rollback"},
    {"shape", "plane sphere box capsule mesh voxels"},
    {"rigid_shape", "sphere box capsule -mesh -voxels"},
    {"tool_shape", "sphere capsule box mesh grasper scissors ellipsoid blade"},
    {"cut_shape", "plane blade sphere box ellipsoid"},
    {"cut_mode", "remove split"},
    {"joint_type", "hinge slider ball fixed"},
    {"make", "beam bricks cylinder ball tube"},
    {"crumbs", "stay remove"},
    {"from", "boundary"},
    {"flatten", "plane line point"},
    {"precision", "double single"},
    {"device", "cpu gpu auto"},
    {"coupling", "barycentric mls thesis"},
    {"by", "auto area mass"},
    {"color", "body contact speed displacement stress"},
};

class Names {
 public:
  template <size_t n>
  explicit Names(const Row (&rows)[n]) {
    for (const Row &row : rows) {
      kinds.push_back(row.of);
      keys_.emplace_back();
      for (const char *at = row.names; *at; at += std::strspn(at, " ")) {
        const char *const end = at + std::strcspn(at, " ");
        const bool delivered = *at != '-';
        keys_.back().push_back({{delivered ? at : at + 1, end}, delivered});
        at = end;
      }
    }
  }
  const std::vector<Key> &operator[](const std::string &kind) const {
    for (size_t i = 0; i < kinds.size(); ++i)
      if (kinds[i] == kind) return keys_[i];
    throw std::logic_error("no such table in scene/keys: " + kind);
  }
  std::vector<std::string> kinds;

 private:
  std::vector<std::vector<Key>> keys_;
};

const Names &objects() {
  static const Names names(kObjects);
  return names;
}
const Names &words() {
  static const Names names(kWords);
  return names;
}

}  // namespace

const std::vector<Key> &keys_of(const std::string &kind) { return objects()[kind]; }
const std::vector<Key> &words_of(const std::string &what) { return words()[what]; }
uint32_t number_of(const std::string &what, const std::string &word) {
  const std::vector<Key> &rows = words_of(what);
  const auto at = std::find_if(rows.begin(), rows.end(), [&](const Key &k) { return k.name == word; });
  return static_cast<uint32_t>(at - rows.begin());
}

const std::string &word_of(const std::string &what, uint32_t number) { return words_of(what)[number].name; }

const std::vector<std::string> &object_kinds() { return objects().kinds; }
const std::vector<std::string> &word_sets() { return words().kinds; }

}  // namespace dfm::scene
