#include "live/pull.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "messages.h"

namespace live {

using render::Vec;

std::string text_of(const Vec &v) {
  const double x[3] = {v.x, v.y, v.z};
  return cli::json_vector(x);
}

namespace {

Vec at(const std::vector<double> &xyz, size_t i) { return render::vec(&xyz[3 * i]); }

// The points near a place, the nearer the heavier: one point alone would tear its cells.
struct Patch {
  std::vector<std::string> points;
  std::vector<double> weights;
  Vec middle;
};

Patch patch_around(const std::vector<double> &x, const Vec &place) {
  const size_t n = x.size() / 3, wanted = std::clamp<size_t>(n / 20, std::min<size_t>(n, 4), 64);
  std::vector<std::pair<double, size_t>> near(n);
  for (size_t i = 0; i < n; ++i) near[i] = {render::norm(at(x, i) - place), i};
  std::sort(near.begin(), near.end());
  const double reach = wanted < n ? near[wanted].first : 1.1 * near.back().first;
  Patch out;
  double sum = 0;
  for (size_t k = 0; k < wanted; ++k) {
    const double away = near[k].first / reach, w = 1 - away * away;
    if (!(w > 0)) continue;
    out.points.push_back(std::to_string(near[k].second));
    out.weights.push_back(w);
    out.middle = out.middle + at(x, near[k].second) * w;
    sum += w;
  }
  out.middle = out.middle * (1 / sum);
  return out;
}

// Its thing is 0 where there is none.
dfm_query_hit first_hit(const cli::SceneFile &scene, const Vec &origin, const Vec &direction) {
  dfm_query_shape from = dfm_query_shape_default();
  from.shape = DFM_SHAPE_POINT;
  from.pose.position[0] = origin.x;
  from.pose.position[1] = origin.y;
  from.pose.position[2] = origin.z;
  const double along[3] = {direction.x, direction.y, direction.z};
  dfm_query_hit hit = {};
  dfm_query_hits hits = {sizeof hits, sizeof hit, 1, 0, &hit};
  cli::need(dfm_world_query(scene.world(), &from, along, std::numeric_limits<double>::infinity(), nullptr,
                            nullptr, &hits));
  return hit;
}
// As it is now: cuts and tears change points and triangles, and bring and take bodies. nullptr: it is gone.
const cli::BodyView *view_of(const cli::SceneFile &scene, dfm_body body) {
  scene.renew_list();
  const auto &all = scene.bodies();
  const auto at = std::ranges::find(all, body, &cli::BodyView::handle);
  if (at == all.end()) return nullptr;
  scene.renew(static_cast<size_t>(at - all.begin()));
  return &*at;
}
bool is_body(const dfm_query_hit &hit) { return dfm_handle_kind(hit.thing) == DFM_HANDLE_BODY; }

}  // namespace

int Pull::tool_at(const Grip &grip, const Vec &origin, const Vec &direction) const {
  const dfm_query_hit hit = first_hit(simulation_.scene(), origin, direction);
  return hit.thing && !is_body(hit) ? grip.tool_of(simulation_.scene().name_of(hit.thing)) : -1;
}

bool Pull::grab(const Vec &origin, const Vec &direction) {
  const cli::SceneFile &scene = simulation_.scene();
  const dfm_query_hit hit = first_hit(scene, origin, direction);
  to_ = render::vec(hit.point);
  if (!is_body(hit)) return hit.thing && grab_rigid(scene.name_of(hit.thing));
  rigid_ = 0;
  const cli::BodyView *const view = view_of(scene, hit.thing);
  if (!view) return false;
  const cli::BodyView &body = *view;
  body_ = hit.thing;
  for (int k = 0; k < 3; ++k) corners_[k] = body.triangles[3 * size_t(hit.triangle) + size_t(k)];
  std::vector<double> x(3 * size_t(std::max(body.npoint, body.nsurfel)));
  uint32_t n = 0;
  cli::need(dfm_surface_positions(body.handle, body.nsurfel, x.data(), &n));
  const Vec a = at(x, corners_[0]), u = at(x, corners_[1]) - a, v = at(x, corners_[2]) - a, p = to_ - a;
  const Vec normal = cross(u, v);
  const double area = dot(normal, normal);
  weights_[1] = area > 0 ? dot(cross(p, v), normal) / area : 0;
  weights_[2] = area > 0 ? dot(cross(u, p), normal) / area : 0;
  weights_[0] = 1 - weights_[1] - weights_[2];
  x.resize(3 * size_t(body.npoint));
  cli::need(dfm_body_get_state(body.handle, body.npoint, x.data(), nullptr, &n));
  const Patch patch = patch_around(x, to_);
  offset_ = patch.middle - to_;
  const dfm_body_info info = cli::got<dfm_body_info>(dfm_body_get_info, body.handle);
  const double rate = 2 * std::numbers::pi * 4, k = stiffness * info.mass * rate * rate;
  cli::JsonObject line;
  line.add("do", "\"pull\"", "body", cli::quoted(body.name), "points", cli::json_array(patch.points),
           "weights", cli::json_numbers(patch.weights), "to", text_of(patch.middle), "stiffness", k,
           "damping", std::sqrt(k * info.mass));  // half of the critical one
  // a model that steps itself and has no step bound takes no spring
  try {
    simulation_.act(line);
    return true;
  } catch (const cli::Failure &) {
    offset_ = {};
    cli::JsonObject held;
    std::vector<std::string> corners;
    for (const uint32_t corner : corners_) corners.push_back(std::to_string(corner));
    held.add("do", "\"drag\"", "body", cli::quoted(body.name), "corners", cli::json_array(corners), "weights",
             cli::json_vector(weights_));
    return drag(held, info.mass);
  }
}

bool Pull::grab_rigid(const std::string &name) {
  for (const cli::RigidView &r : simulation_.scene().rigids()) {
    const dfm_rigid_def def = cli::got<dfm_rigid_def>(dfm_rigid_get_def, r.handle);
    if (r.name != name || def.fixed) continue;
    dfm_rigid_state state = {};
    cli::need(dfm_rigid_get_state(r.handle, &state));
    const double *const q = state.rotation, back[4] = {-q[0], -q[1], -q[2], q[3]};
    const double away[3] = {to_.x - state.position[0], to_.y - state.position[1], to_.z - state.position[2]};
    cli::rotate(back, away, arm_);
    rigid_ = r.handle;
    offset_ = {};
    cli::JsonObject held;
    held.add("do", "\"drag\"", "rigid", cli::quoted(name), "place", cli::json_vector(arm_));
    return drag(held, def.mass);
  }
  return false;
}

bool Pull::drag(cli::JsonObject &line, double mass) {
  const double rate = 2 * std::numbers::pi * 4, k = stiffness * mass * rate * rate;
  line.add("to", text_of(to_), "stiffness", k, "damping", std::sqrt(k * mass));  // half of the critical one
  simulation_.act(line);
  return true;
}

void Pull::move(const Vec &to) {
  if (!holds() || (to.x == to_.x && to.y == to_.y && to.z == to_.z)) return;
  to_ = to;
  cli::JsonObject line;
  simulation_.act(line.add("do", "\"move\"", "to", text_of(to_ + offset_)));
}

Vec Pull::place() const {
  if (rigid_) {
    dfm_rigid_state state = {};
    cli::need(dfm_rigid_get_state(rigid_, &state));
    double arm[3];
    cli::rotate(state.rotation, arm_, arm);
    return render::vec(state.position) + render::vec(arm);
  }
  const cli::BodyView *const body = view_of(simulation_.scene(), body_);
  if (!body || std::ranges::max(corners_) >= body->nsurfel) return to_;  // a cut has taken the place
  std::vector<double> x(3 * size_t(body->nsurfel));
  uint32_t n = 0;
  cli::need(dfm_surface_positions(body->handle, body->nsurfel, x.data(), &n));
  Vec out;
  for (int k = 0; k < 3; ++k) out = out + at(x, corners_[k]) * weights_[k];
  return out;
}

double Pull::force() const {
  double f[3];
  simulation_.hand().force(f);
  return render::norm(render::vec(f));
}

}  // namespace live
