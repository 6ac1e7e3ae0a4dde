#include "by_hand.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <utility>

#include "messages.h"

namespace cli {
namespace {

std::vector<uint32_t> below(double n, const JsonValue &line, const char *key) {
  std::vector<uint32_t> out;
  for (const double number : line.numbers(key)) {
    if (!(number >= 0 && number < n))
      throw Failure(kBadInput, '"' + std::string(key) + "\": the body has no " +
                                   std::string(key, std::strlen(key) - 1) + " " + cli::number(number) +
                                   "; record again");
    out.push_back(uint32_t(number));
  }
  return out;
}

void cross(const double a[3], const double b[3], double out[3]) {
  for (int k = 0; k < 3; ++k) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

// What an impulse at an arm from the center of mass changes of a rigid body's velocities.
void strike(dfm_rigid rigid, const double arm[3], const double impulse[3]) {
  const dfm_rigid_def def = got<dfm_rigid_def>(dfm_rigid_get_def, rigid);
  dfm_rigid_state state = {};
  need(dfm_rigid_get_state(rigid, &state));
  const double *const q = state.rotation, back[4] = {-q[0], -q[1], -q[2], q[3]};
  double moment[3], own[3], spin[3];
  cross(arm, impulse, moment);
  rotate(back, moment, own);
  for (int k = 0; k < 3; ++k) own[k] /= def.inertia[k];
  rotate(q, own, spin);
  for (int k = 0; k < 3; ++k) {
    state.velocity[k] += impulse[k] / def.mass;
    state.spin[k] += spin[k];
  }
  need(dfm_rigid_set_state(rigid, &state));
}

}  // namespace

const BodyView &ByHand::body(const JsonValue &line) const {
  for (const BodyView &b : scene_.bodies())
    if (b.name == line.get("body")) return b;
  throw Failure(kBadInput, "there is no body '" + line.get("body") + "'");
}

void ByHand::pull(const JsonValue &line) {
  const std::vector<uint32_t> places = below(0x1p32, line, "points");  // the library knows how many there are
  const std::vector<double> weights = line.numbers("weights");
  const std::vector<double> to = line.numbers("to", 3);
  if (weights.size() != places.size()) throw Failure(kBadInput, "a pull needs one weight for each point");
  dfm_spring_def def = {};
  def.size = sizeof def;
  def.npoint = uint32_t(places.size());
  def.points = places.data();
  def.weights = weights.data();
  for (int i = 0; i < 3; ++i) def.to[i] = to[size_t(i)];
  def.stiffness = line.scalar("stiffness");
  def.damping = line.scalar("damping");
  const dfm_body of = body(line).handle;
  need(dfm_body_add_spring(of, &def, &spring_));
  body_ = of;
}

void ByHand::drag(const JsonValue &line) {
  Drag d;
  d.to = line.numbers("to", 3);
  d.stiffness = line.scalar("stiffness");
  d.damping = line.scalar("damping");
  d.rigid = line.find("rigid") != nullptr;
  dfm_body_measure m = {};
  m.size = sizeof m;
  if (d.rigid) {
    for (const RigidView &r : scene_.rigids())
      if (r.name == line.get("rigid")) d.thing = r.handle;
    if (!d.thing) throw Failure(kBadInput, "there is no rigid body '" + line.get("rigid") + "'");
    d.place = line.numbers("place", 3);
    need(dfm_rigid_get_measure(d.thing, &m));
  } else {
    const BodyView &of = body(line);
    d.corners = below(of.nsurfel, line, "corners");
    d.weights = line.numbers("weights");
    if (d.corners.size() != 3 || d.weights.size() != 3)
      throw Failure(kBadInput, "a drag needs three corners and one weight for each");
    d.thing = of.handle;
    need(dfm_body_get_measure(of.handle, &m));
  }
  d.mass = m.mass;
  drag_ = std::move(d);
}

bool ByHand::at(double place[3], double velocity[3]) const {
  if (drag_.rigid) {
    dfm_rigid_state state = {};
    need(dfm_rigid_get_state(drag_.thing, &state));
    double arm[3], turn[3];
    rotate(state.rotation, drag_.place.data(), arm);
    cross(state.spin, arm, turn);
    for (int k = 0; k < 3; ++k) {
      place[k] = state.position[k] + arm[k];
      velocity[k] = state.velocity[k] + turn[k];
    }
    return true;
  }
  uint32_t n = 0;
  std::fill_n(place, 3, 0.0);
  std::fill_n(velocity, 3, 0.0);
  for (const BodyView &b : scene_.bodies()) {
    if (b.handle != drag_.thing) continue;
    if (std::ranges::max(drag_.corners) >= b.nsurfel) return false;
    std::vector<double> x(3 * size_t(b.nsurfel)), v(x.size());
    need(dfm_surface_positions(b.handle, b.nsurfel, x.data(), &n));
    need(dfm_surface_velocities(b.handle, b.nsurfel, v.data(), &n));
    for (size_t k = 0; k < 3; ++k) {
      for (size_t c = 0; c < 3; ++c) {
        place[k] += drag_.weights[c] * x[3 * size_t(drag_.corners[c]) + k];
        velocity[k] += drag_.weights[c] * v[3 * size_t(drag_.corners[c]) + k];
      }
    }
    return true;
  }
  return false;
}

// Backward Euler of the spring and the damper on a point of an eighth of the mass: no solid body's surface
// moves more easily under an impulse, so the pull is stable at any stiffness.
void ByHand::before_step(double h) {
  tools_.before_step(h);
  if (!drag_.thing) return;
  double x[3], v[3], impulse[3], arm[3];
  if (!at(x, v)) {  // a cut has taken the place
    drag_.thing = 0;
    return;
  }
  const double share = 1 / (1 + h * (drag_.damping + h * drag_.stiffness) / (drag_.mass / 8));
  for (size_t k = 0; k < 3; ++k) {
    drag_.force[k] = share * (drag_.stiffness * (drag_.to[k] - x[k] - h * v[k]) - drag_.damping * v[k]);
    impulse[k] = h * drag_.force[k];
  }
  if (!drag_.rigid) {
    need(dfm_body_apply_impulse(drag_.thing, x, impulse));
    return;
  }
  dfm_rigid_state state = {};
  need(dfm_rigid_get_state(drag_.thing, &state));
  rotate(state.rotation, drag_.place.data(), arm);
  strike(drag_.thing, arm, impulse);
}

void ByHand::cut(const JsonValue &line) const {
  dfm_cut_def def = dfm_cut_def_default();
  const std::vector<double> blade = line.numbers("blade", std::size(def.blade));
  def.shape = DFM_CUT_BLADE;
  def.how = DFM_CUT_SPLIT;
  std::copy(blade.begin(), blade.end(), def.blade);
  std::string why;
  bool any = false;
  for (const BodyView &b : scene_.bodies()) {
    if (dfm_body_cut(b.handle, &def, nullptr) == DFM_OK) any = true;
    else if (why.empty()) why = dfm_last_error();
  }
  if (!any) throw Failure(kBadInput, why.empty() ? "there is no body to cut" : why);
}

void ByHand::act(const JsonValue &line) {
  const std::string what = line.get("do");
  const double value = line.scalar("value");
  const std::string key = line.get("key");
  const dfm_param_value row = {key.c_str(), &value, 1};
  const dfm_params params = {sizeof(dfm_params), 1, &row};
  if (what == "pull") {
    pull(line);
  } else if (what == "drag") {
    drag(line);
  } else if (what == "move" && drag_.thing) {
    drag_.to = line.numbers("to", 3);
  } else if (what == "release" && drag_.thing) {
    drag_.thing = 0;
  } else if (what == "move" && body_) {
    need(dfm_body_set_spring_target(body_, spring_, line.numbers("to", 3).data()));
  } else if (what == "release" && body_) {
    // over in any case: a cut may have taken its points
    need(dfm_body_remove_spring(std::exchange(body_, 0), spring_));
  } else if (what == "tool") {
    tools_.lead(line);
  } else if (what == "let") {
    tools_.let(line);
  } else if (what == "cut") {
    cut(line);
  } else if (what == "gravity") {
    need(dfm_world_set_gravity(scene_.world(), line.numbers("to", 3).data()));
  } else if (what == "friction") {
    const JsonValue *const sides = line.find("between");
    if (!sides || sides->items.size() != 2) throw Failure(kBadInput, "friction needs two sides");
    need(dfm_world_set_friction(scene_.world(), sides->items[0].text.c_str(), sides->items[1].text.c_str(),
                                &params));
  } else if (what == "param") {
    need(dfm_body_set_params(body(line).handle, &params));
  } else if (what == "step") {
    step_ = line.scalar("length");
  } else {
    throw Failure(kBadInput, "\"" + what + "\" is nothing that a hand does here");
  }
}

void ByHand::force(double out[3]) const {
  if (drag_.thing) std::copy_n(drag_.force, 3, out);
  else need(dfm_body_get_spring_force(body_, spring_, out));
}

}  // namespace cli
