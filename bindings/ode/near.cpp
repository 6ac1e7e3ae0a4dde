#include "near.h"

#include <algorithm>

#include "engine.h"
#include "rigid_host/host.h"

namespace dfm_ode_detail {
namespace {

constexpr uint32_t kMax = 64;
// m: contacts of two sub-steps that are farther apart are different contacts
constexpr double kSamePlace = 0.01;

Vec velocity_at(dBodyID b, Vec p) {
  if (!b) return {};
  return load(dBodyGetLinearVel(b)) + cross(load(dBodyGetAngularVel(b)), p - load(dBodyGetPosition(b)));
}

Vec any_tangent(Vec n) {
  const Vec axis = std::fabs(n.x) < 0.6 ? Vec{1, 0, 0} : Vec{0, 1, 0}, t = cross(n, axis);
  return (1 / norm(t)) * t;
}

bool is_direction(Vec v) { return std::fabs(dot(v, v) - 1) < 1e-3; }

}  // namespace

RigidFriction::~RigidFriction() { clear_law(); }

void RigidFriction::clear_law() {
  if (law_) dfm_law_close(law_);
  law_ = 0;
  nstate_ = 0;
  last_.clear();
}

dfm_status RigidFriction::set_law(dfm_context *context, const char *law, const dfm_params *params,
                                  double area) {
  if (!(area > 0 && std::isfinite(area)))
    return failed(DFM_E_ARG, "area %g m2; a contact's area is positive and finite", area);
  dfm_law opened = 0;
  if (const dfm_status s = dfm_law_open(context, law, &opened); s != DFM_OK) return s;
  const dfm_type *type = nullptr;
  uint32_t n = 0;
  dfm_status s = dfm_law_type(opened, &type);
  if (s == DFM_OK) s = dfm_law_pack(opened, params, 0, nullptr, &n);
  std::vector<double> values(n);
  if (s == DFM_OK) s = dfm_law_pack(opened, params, n, values.data(), &n);
  if (s != DFM_OK) {
    dfm_law_close(opened);
    return s;
  }
  if (law_) dfm_law_close(law_);
  const dfm_friction &ops = *static_cast<const dfm_friction *>(type->ops);
  law_ = opened;
  params_ = std::move(values);
  area_ = area;
  set_valued_ = ops.flags & DFM_FRIC_SET_VALUED;
  nstate_ = 0;
  for (uint32_t i = 0; i < ops.nslot; ++i) nstate_ += ops.slots[i].width;
  last_.clear();
  return DFM_OK;
}

// One contact in a batch of eight lanes.
RigidFriction::LawResult RigidFriction::evaluate(const Contact &c, const double vt[2], double dt) const {
  constexpr uint32_t kLanes = 8;
  alignas(64) double fn[kLanes] = {c.fn}, v[2 * kLanes] = {}, stop[2 * kLanes] = {}, area[kLanes] = {area_},
                     dwell[kLanes] = {};
  alignas(64) double ft[2 * kLanes] = {}, d[4 * kLanes] = {}, by_fn[2 * kLanes] = {}, limit[kLanes] = {};
  std::vector<double> state(size_t{kLanes} * std::max(1u, nstate_)), next(state.size());
  v[0] = vt[0];
  v[kLanes] = vt[1];
  // The force that would stop the slip within a step, with the mass of the lighter body alone: distinguishes
  // laws that stick from those that slide.
  double mass = 1e300;
  for (const dBodyID b : {c.a, c.b}) {
    if (!b || dBodyIsKinematic(b)) continue;
    dMass m;
    dBodyGetMass(b, &m);
    mass = std::min(mass, m.mass);
  }
  stop[0] = -mass / dt * vt[0];
  stop[kLanes] = -mass / dt * vt[1];
  for (uint32_t i = 0; i < nstate_; ++i) state[size_t{kLanes} * i] = c.state[i];
  dfm_friction_in in{};
  in.size = sizeof in;
  in.n = 1;
  in.stride = kLanes;
  in.dt = dt;
  in.params = params_.data();
  in.fn = fn;
  in.vt = v;
  in.ft_stop = stop;
  in.area = area;
  in.dwell = dwell;
  in.state = state.data();
  dfm_friction_out out{};
  uint8_t mode[kLanes] = {};
  out.size = sizeof out;
  out.ft = ft;
  out.dft_dvt = d;
  out.dft_dfn = by_fn;
  out.limit = limit;
  out.state = next.data();
  out.mode = mode;
  LawResult a{};
  a.good = dfm_law_eval(law_, &in, &out) == DFM_OK;
  if (!a.good) return a;
  a.ft[0] = ft[0];
  a.ft[1] = ft[kLanes];
  a.d[0] = -d[0];
  a.d[1] = -d[size_t{3} * kLanes];
  a.limit = limit[0];
  // of one that slides: what it slides with
  const bool slides = set_valued_ && mode[0] == 2;
  const auto size = [](double x, double y) { return std::sqrt(x * x + y * y); };  // hypot needs a later glibc
  if (slides) a.limit = size(a.ft[0], a.ft[1]);
  a.by_fn = slides ? size(by_fn[0], by_fn[kLanes]) : c.fn > 0 ? a.limit / c.fn : 0;
  for (uint32_t i = 0; i < nstate_; ++i) a.state.push_back(next[size_t{kLanes} * i]);
  return a;
}

const RigidFriction::Contact *RigidFriction::match(const Key &key, Vec place,
                                                   std::vector<bool> &taken) const {
  const auto pair = last_.find(key);
  if (pair == last_.end()) return nullptr;
  taken.resize(pair->second.size());
  size_t best = pair->second.size();
  double least = kSamePlace;
  for (size_t i = 0; i < pair->second.size(); ++i) {
    const double d = norm(pair->second[i].place - place);
    if (!taken[i] && d < least) {
      least = d;
      best = i;
    }
  }
  if (best == pair->second.size()) return nullptr;
  taken[best] = true;
  return &pair->second[best];
}

// The frame moves with the surface, so that components in its axes stay valid.
void RigidFriction::take_over(Contact &c, const Contact &old) const {
  const Vec t = old.tangent[0] - dot(old.tangent[0], c.normal) * c.normal;
  if (norm(t) > 0.1) {
    c.tangent[0] = (1 / norm(t)) * t;
    c.tangent[1] = cross(c.normal, c.tangent[0]);
  }
  c.fn = old.fn;
  c.state = old.state;
}

int RigidFriction::collide(dGeomID a, dGeomID b, double dt) {
  // ODE swaps the bodies of a joint if the first one is the world; motion and slip then change their signs
  if (!dGeomGetBody(a)) std::swap(a, b);
  const dBodyID body_a = dGeomGetBody(a), body_b = dGeomGetBody(b);
  dContact contacts[kMax];
  const int found =
      dCollide(a, b, static_cast<int>(std::min(most, kMax)), &contacts[0].geom, sizeof(dContact));
  std::vector<bool> taken;
  for (int i = 0; i < found; ++i) {
    dContact &c = contacts[i];
    c.surface = {};
    c.surface.mode = dContactApprox1;
    c.surface.mu = coefficient;
    if (!law_) {
      dJointAttach(dJointCreateContact(world, group, &c), body_a, body_b);
      continue;
    }
    Contact &mine = now_.emplace_back();
    mine.key = {a, b};
    mine.a = body_a;
    mine.b = body_b;
    mine.point = load(c.geom.pos);
    mine.normal = load(c.geom.normal);
    const Quat q = body_a ? from_ode(dBodyGetQuaternion(body_a)) : Quat{};
    mine.place = rotate(conjugate(q), mine.point - (body_a ? load(dBodyGetPosition(body_a)) : Vec{}));
    mine.state.assign(nstate_, 0.0);
    mine.tangent[0] = any_tangent(mine.normal);
    mine.tangent[1] = cross(mine.normal, mine.tangent[0]);
    if (const Contact *old = match(mine.key, mine.place, taken)) take_over(mine, *old);
    const Vec u = velocity_at(body_a, mine.point) - velocity_at(body_b, mine.point);
    const double vt[2] = {dot(u, mine.tangent[0]), dot(u, mine.tangent[1])};
    // A coefficient needs some force for its evaluation. How much a viscous part is beside one that is not
    // known yet cannot be said: it is left out until the next sub-step.
    const bool fresh = set_valued_ && !(mine.fn > 0);
    if (fresh) mine.fn = 1;
    const LawResult result = evaluate(mine, vt, dt);
    if (result.good && set_valued_) {
      c.surface.mu = fresh ? result.by_fn : result.limit / mine.fn;
    } else if (result.good) {
      c.surface.mode = dContactMu2 | dContactFDir1;
      c.surface.mu = c.surface.mu2 = std::min(result.limit, double{dInfinity});
      store(c.fdir1, mine.tangent[0]);
      const double *const d = result.d, *const f = result.ft;
      if (d[0] > 0) {
        c.surface.mode |= dContactSlip1 | dContactMotion1;
        c.surface.slip1 = 1 / d[0];
        c.surface.motion1 = vt[0] + f[0] / d[0];
      }
      if (d[1] > 0) {
        c.surface.mode |= dContactSlip2 | dContactMotion2;
        c.surface.slip2 = 1 / d[1];
        c.surface.motion2 = vt[1] + f[1] / d[1];
      }
    }
    const dJointID j = dJointCreateContact(world, group, &c);
    dJointAttach(j, body_a, body_b);
    dJointSetFeedback(j, &mine.feedback);
  }
  return found;
}

void RigidFriction::finish_step(double dt) {
  if (!law_) return drop();
  last_.clear();
  for (Contact &c : now_) {
    const Vec u = velocity_at(c.a, c.point) - velocity_at(c.b, c.point);
    const double vt[2] = {dot(u, c.tangent[0]), dot(u, c.tangent[1])};
    c.fn = std::max(0.0, dot(load(c.feedback.f1), c.normal));
    if (nstate_) {
      LawResult result = evaluate(c, vt, dt);
      if (result.good) c.state = std::move(result.state);
    }
    last_[c.key].push_back(std::move(c));
  }
  now_.clear();
}

// nstate, contacts; of each: its geoms, place, normal, first tangent, force, state.
void RigidFriction::save(const std::function<double(dGeomID)> &number, std::vector<double> &out) const {
  struct Row {
    double a, b;
    const Contact *contact;
  };
  std::vector<Row> rows;
  for (const auto &[key, contacts] : last_) {
    const double a = number(key.first), b = number(key.second);
    for (const Contact &c : contacts)
      if (a >= 0 && b >= 0) rows.push_back({a, b, &c});
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row &l, const Row &r) { return l.a != r.a ? l.a < r.a : l.b < r.b; });
  out.push_back(nstate_);
  out.push_back(double(rows.size()));
  for (const Row &r : rows) {
    const Contact &c = *r.contact;
    out.push_back(r.a);
    out.push_back(r.b);
    for (const Vec &v : {c.place, c.normal, c.tangent[0]}) out.insert(out.end(), {v.x, v.y, v.z});
    out.push_back(c.fn);
    out.insert(out.end(), c.state.begin(), c.state.end());
  }
}

bool RigidFriction::read(const std::function<dGeomID(double)> &geom, const double *from, size_t count,
                         Memory &out) const {
  const size_t row = 12 + size_t{nstate_};
  if (count < 2 || from[0] != nstate_ || from[1] * double(row) + 2 != double(count)) return false;
  for (const double *p = from + 2; p != from + count; p += row) {
    const dGeomID a = geom(p[0]), b = geom(p[1]);
    if (!a || !b) return false;
    Contact c{};
    c.key = {a, b};
    c.a = dGeomGetBody(a);
    c.b = dGeomGetBody(b);
    c.place = load(p + 2);
    c.normal = load(p + 5);
    c.tangent[0] = load(p + 8);
    c.tangent[1] = cross(c.normal, c.tangent[0]);
    c.fn = p[11];
    c.state.assign(p + 12, p + row);
    if (!(c.fn >= 0) || !is_direction(c.normal) || !is_direction(c.tangent[0])) return false;
    out[c.key].push_back(std::move(c));
  }
  return true;
}

void near_callback(void *data, dGeomID a, dGeomID b) {
  RigidFriction &n = *static_cast<RigidFriction *>(data);
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) {
    dSpaceCollide2(a, b, data, near_callback);  // pairs within one space: the engine collides them, once
    return;
  }
  const dBodyID body_a = dGeomGetBody(a), body_b = dGeomGetBody(b);
  if (body_a == body_b) return;  // two geoms of one body, or two that never move
  if (body_a && body_b && dAreConnectedExcluding(body_a, body_b, dJointTypeContact)) return;
  n.collide(a, b, n.h);
}

}  // namespace dfm_ode_detail
