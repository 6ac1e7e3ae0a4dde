// The pose of a tool at the end of a sub-step, and its response to impulses. The frame is that of body 0.
//
//   not coupled   it goes to its target at constant rate, and answers no impulse
//   coupled       spring and damper at the end of the sub-step (backward Euler), D the device:
//                     m (v' - v) = h (k (D' - x - h v') + c (v_D - v')) + p
//                 so v' = (m v + h k (D' - x) + h c v_D + p) / (m + h c + h^2 k), the same for turning with
//                 the rotation vector from the tool to the device, whose torque is the gradient of
//                 k |r|^2 / 2. In each sub-step the spring's energy and the motion's rise by at most what
//                 device and contact put in, whatever k, c, m and h are: an implicit virtual coupling is
//                 passive (Colgate, Stanley and Brown 1995; Adams and Hannaford 1999).
//   parts         impulse p at a part's center r acts on the frame as (p, r x p)
#include "dynamics/rigid/tool_host.h"

#include <algorithm>
#include <cstring>
#include <new>

#include "core/error.h"
#include "dynamics/rigid/host_table.h"
#include "math/turn.h"

namespace dfm {
namespace {

// Share of a step that may remain by rounding.
constexpr double kWhole = 1 - 1e-9;

struct Frame {
  Vec3 velocity, spin;  // mean over the sub-step
};
Frame mean_between(const Pose &from, const Pose &to, double h) {
  return {(1 / h) * (to.position - from.position),
          (1 / h) * rotation_vector(to.rotation * conjugate(from.rotation))};
}

class ToolHost {
 public:
  explicit ToolHost(const ToolMotion &motion) : motion_(motion) {}
  bool late() const { return motion_.late > 0; }
  void predict(const dfm_rigid_step &step, double *velocity) const;
  void respond(const dfm_rigid_step &step, uint32_t group, double *matrix) const;
  void commit(const dfm_rigid_step &step, const double *impulse, dfm_rigid_state *state, double *extra) const;

 private:
  ToolMotion motion_;

  struct Ways {
    ToolValues values;
    Pose start, device;  // device: at the end of the sub-step
    double opening;      // then
  };
  Ways ways(const dfm_rigid_step &step) const;
  Frame move(const dfm_rigid_step &step, const Ways &w, Vec3 p, Vec3 turn) const;
  Pose end_of(const dfm_rigid_step &step, const Ways &w, const Frame &mean) const;
  double mobility(double h) const {
    return motion_.coupled() ? 1 / (motion_.mass + h * motion_.damping + h * h * motion_.stiffness) : 0;
  }
  double turn_mobility(double h) const {
    return motion_.coupled()
               ? 1 / (motion_.inertia + h * motion_.turn_damping + h * h * motion_.turn_stiffness)
               : 0;
  }
  Vec3 arm(const dfm_rigid_step &step, size_t part) const {
    return load3(step.state[part].position) - load3(step.state[0].position);
  }
};

// The remaining motion, of which a sub-step takes its share. A tool that is not coupled starts from its
// present pose, because the guard may have stopped it early.
ToolHost::Ways ToolHost::ways(const dfm_rigid_step &step) const {
  Ways w{tool_values(step.extra), load_pose(step.state[0]), {}, 0};
  const Pose from = motion_.coupled() ? load_place(w.values.device) : w.start;
  const Pose to = load_place(w.values.target);
  const double left = w.values.goal - step.t, share = left > 0 ? step.h / left : 1;
  if (share >= kWhole) {
    w.device = to;
    w.opening = w.values.target_opening;
  } else {
    w.device = {from.position + share * (to.position - from.position),
                slerp(from.rotation, to.rotation, share)};
    w.opening = w.values.opening + share * (w.values.target_opening - w.values.opening);
  }
  return w;
}

Frame ToolHost::move(const dfm_rigid_step &step, const Ways &w, Vec3 p, Vec3 turn) const {
  const double h = step.h;
  if (!motion_.coupled()) return mean_between(w.start, w.device, h);
  const auto [way, turned_by] = mean_between(w.start, w.device, 1);
  const Frame device = w.values.measured == kToolMeasured
                           ? Frame{load3(w.values.target_velocity), load3(w.values.target_velocity + 3)}
                           : mean_between(load_place(w.values.device), w.device, h);
  const dfm_rigid_state &s = step.state[0];
  return {mobility(h) * (motion_.mass * load3(s.velocity) +
                         h * (motion_.stiffness * way + motion_.damping * device.velocity) + p),
          turn_mobility(h) *
              (motion_.inertia * load3(s.spin) +
               h * (motion_.turn_stiffness * turned_by + motion_.turn_damping * device.spin) + turn)};
}

Pose ToolHost::end_of(const dfm_rigid_step &step, const Ways &w, const Frame &mean) const {
  if (!motion_.coupled()) return w.device;
  return {w.start.position + step.h * mean.velocity, turned(w.start.rotation, step.h * mean.spin)};
}

// Mean velocities of the parts from their end poses: parts that rotate with the frame move along an arc.
void ToolHost::predict(const dfm_rigid_step &step, double *velocity) const {
  const Ways w = ways(step);
  const Pose end = end_of(step, w, move(step, w, {}, {}));
  for (size_t i = 0; i < motion_.parts.size(); ++i) {
    const Frame mean =
        mean_between(load_pose(step.state[i]), part_place(motion_.parts[i], end, w.opening), step.h);
    store3(velocity + 6 * i, mean.velocity);
    store3(velocity + 6 * i + 3, mean.spin);
  }
}

void ToolHost::respond(const dfm_rigid_step &step, uint32_t, double *matrix) const {
  const size_t n = motion_.parts.size(), width = 6 * n;
  const double a = mobility(step.h), b = turn_mobility(step.h);
  for (size_t j = 0; j < width; ++j) {
    const size_t k = j % 6;
    Vec3 unit;
    unit[int(k % 3)] = 1;
    const Vec3 p = k < 3 ? unit : Vec3{}, turn = k < 3 ? cross(arm(step, j / 6), unit) : unit;
    for (size_t i = 0; i < n; ++i) {
      const Vec3 velocity = a * p + b * cross(turn, arm(step, i)), spin = b * turn;
      for (size_t l = 0; l < 3; ++l) {
        matrix[(6 * i + l) * width + j] = velocity[int(l)];
        matrix[(6 * i + 3 + l) * width + j] = spin[int(l)];
      }
    }
  }
}

void ToolHost::commit(const dfm_rigid_step &step, const double *impulse, dfm_rigid_state *state,
                      double *extra) const {
  const Ways w = ways(step);
  Vec3 p, turn;
  for (size_t i = 0; i < motion_.parts.size(); ++i) {
    const Vec3 q = load3(impulse + 6 * i);
    p += q;
    turn += load3(impulse + 6 * i + 3) + cross(arm(step, i), q);
  }
  const Frame mean = move(step, w, p, turn);
  const Pose end = end_of(step, w, mean);
  ToolValues v = w.values;
  const Pose device = motion_.coupled() ? load_place(v.device) : w.start;
  const auto [way, turned_by] = mean_between(device, w.device, 1);
  // The reaction on the tool is the impulse that it received minus the part that moves it; without a coupling
  // all of it.
  Vec3 held = -p, held_turn = -turn;
  if (motion_.coupled()) {
    held += motion_.mass * (mean.velocity - load3(step.state[0].velocity));
    held_turn += motion_.inertia * (mean.spin - load3(step.state[0].spin));
  }
  add3(v.contact, p);
  // about a point that is fixed during the step, because the origin moves in each sub-step
  store3(v.contact + 3,
         load3(v.contact + 3) + turn + cross(load3(step.state[0].position) - load3(v.about), p));
  add3(v.coupling, held);
  add3(v.coupling + 3, held_turn);
  v.work += (dot(held, way) + dot(held_turn, turned_by)) / step.h;
  v.time += step.h;
  v.opening = w.opening;
  store_place(v.device, w.device);
  store_values(v, extra);
  if (late())  // sub-steps do not change them
    std::memcpy(extra + kToolValues, step.extra + kToolValues, kToolPastValues * sizeof(double));
  for (size_t i = 0; i < motion_.parts.size(); ++i) {
    const Pose to = part_place(motion_.parts[i], end, w.opening);
    const Frame own = mean_between(load_pose(step.state[i]), to, step.h);
    store_pose(state[i], to);
    store3(state[i].velocity, own.velocity);
    store3(state[i].spin, own.spin);
  }
  // exactly: part 0 is the frame
  store3(state[0].velocity, mean.velocity);
  store3(state[0].spin, mean.spin);
}

// ---- the table --------------------------------------------------------------------------------------------

dfm_status create(void *, const dfm_rigid_set_def *set, void **self, uint32_t *group, uint32_t *nextra) {
  if (!set->data) {
    set_last_error("this host is that of tools; dfm_tool_create makes one");
    return DFM_E_ARG;
  }
  auto *const made = new (std::nothrow) ToolHost(*static_cast<const ToolMotion *>(set->data));
  if (!made) return DFM_E_NOMEM;
  *self = made;
  for (uint32_t i = 0; i < set->nbody; ++i) group[i] = 0;
  *nextra = kToolValues + (made->late() ? kToolPastValues : 0);
  return DFM_OK;
}

}  // namespace

ToolValues tool_values(const double *extra) {
  ToolValues v;
  std::memcpy(&v, extra, sizeof v);
  return v;
}
void store_values(const ToolValues &v, double *extra) { std::memcpy(extra, &v, sizeof v); }

Pose load_place(const double *p) { return {load3(p), load_quat(p + 3)}; }
void store_place(double *p, const Pose &place) {
  store3(p, place.position);
  store_quat(p + 3, place.rotation);
}
Pose part_place(const ToolMotion::Part &part, const Pose &tool, double opening) {
  Pose frame = tool;
  if (part.turns != 0) frame.rotation = frame.rotation * turned(Quat{}, {0, part.turns * opening, 0});
  return frame * part.at;
}

const dfm_rigid_host &tool_host() {
  static const dfm_rigid_host table = HostTable<ToolHost>::make(create);
  return table;
}

}  // namespace dfm
