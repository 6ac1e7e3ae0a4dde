// A tool (deform/tool.h): a set of rigid bodies that dynamics/rigid/tool_host.h moves. What changes in a run
// is among the values of the set, so that snapshots contain it; the keys are those of the def and never
// change.
#pragma once
#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "deform/tool.h"
#include "dynamics/rigid/rigid_set.h"
#include "dynamics/rigid/tool_host.h"
#include "state/body.h"
#include "state/obstacle.h"

namespace dfm {

inline bool has_jaws(const dfm_tool_def &d) {
  return d.shape == DFM_TOOL_GRASPER || d.shape == DFM_TOOL_SCISSORS;
}

struct Tool {
  static constexpr char kKind[] = "tool";
  World *world = nullptr;
  uint64_t handle = 0;
  std::string name;
  dfm_tool_def def{};
  ToolMotion motion;
  std::vector<dfm_pose_key> keys;
  std::vector<dfm_scale_key> opening_keys;
  RigidSet *set = nullptr;
  std::vector<uint64_t> parts;  // handles
  dfm_device device{};          // read NULL: none
  bool mute = false;            // the device has refused a force
  // The bodies that it cuts (cut/tool_cut.h).
  struct Cuts {
    uint32_t how = 0, most = 0;
    std::vector<uint64_t> bodies;  // ids, ascending
    std::vector<Pose> from;        // places of its parts up to which it has cut; empty: it has never cut
    bool waits = false;            // its way of this step, or of failed ones before, is yet to be cut
  } cuts;
  bool has_jaws() const { return dfm::has_jaws(def); }
  // Whether it is one of the shapes that every tool of its kind has beside its parts.
  bool has_shape(const Obstacle &o) const {
    return o.rigid == set && o.added && (o.name == name + ".shape" || o.name == name + ".shaft");
  }
  // with its pieces
  bool cuts_body(const Body &b) const {
    const auto in = [&](uint64_t id) {
      return std::binary_search(cuts.bodies.begin(), cuts.bodies.end(), id);
    };
    return in(b.id) || (b.piece_of && in(b.piece_of));
  }
  // First part that cuts: of scissors the jaws, else all parts.
  uint32_t first_cutting_part() const { return def.shape == DFM_TOOL_SCISSORS ? 1 : 0; }
  ToolValues values() const { return tool_values(set->extra.data()); }
  void store(const ToolValues &v) { store_values(v, set->extra.data()); }
  // For a late device (ToolGiven): row of the past; the force that v gives at t goes into the next row.
  ToolGiven past(size_t row) const {
    ToolGiven g;
    std::memcpy(&g, set->extra.data() + kToolValues + row * (sizeof g / sizeof(double)), sizeof g);
    return g;
  }
  // Only some steps are kept where many fit into the delay: what is kept reaches back as far as the device is
  // late.
  bool is_to_remember(double t, const ToolValues &v) const {
    const size_t n = static_cast<size_t>(v.ngiven);
    return motion.late > 0 && (n == 0 || !(t - past((n - 1) % kToolPast).t < motion.late / (kToolPast - 1)));
  }
  void remember(double t, ToolValues &v) {
    const size_t row = static_cast<size_t>(v.ngiven) % kToolPast;
    ToolGiven g{t, {}};
    std::copy(v.given, v.given + 6, g.force);
    std::memcpy(set->extra.data() + kToolValues + row * (sizeof g / sizeof(double)), &g, sizeof g);
    v.ngiven += 1;
  }
};

}  // namespace dfm
