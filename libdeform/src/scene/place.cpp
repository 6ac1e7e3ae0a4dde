#include "scene/place.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/handle.h"
#include "deform/query.h"
#include "deform/world.h"
#include "math/turn.h"
#include "math/vec3.h"
#include "state/world.h"

namespace dfm::scene {
namespace {

constexpr double kSteep = 0.1;  // cosine of a plane's normal to up: what is steeper is a wall

struct Scratch {
  dfm_world world = 0;
  ~Scratch() {
    if (world) dfm_world_destroy(world);
  }
};

void need(dfm_status status) {
  if (status != DFM_OK) fail(status, "%s", dfm_last_error());
}

struct Span { double low = HUGE_VAL, high = -HUGE_VAL; };

template <class Points>
Span along(Vec3 direction, const Points &points) {
  Span out;
  for (size_t i = 0; i + 2 < points.size(); i += 3) {
    const double d = dot(direction, load3(&points[i]));
    out.low = std::min(out.low, d);
    out.high = std::max(out.high, d);
  }
  return out;
}

// m, of all its points from its origin.
double reach_of(const dfm_obstacle_def &o) {
  double out = o.radius + o.half_length + norm(load3(o.half_size));
  for (uint32_t i = 0; i < o.npoint; ++i) out = std::max(out, norm(load3(o.points + 3 * size_t{i})));
  return out;
}

// m, along `up` (unit), negative where it is down: how far points [n,3] move so that their convex hull
// touches the obstacle from above. It is found in a world of its own by the queries that any program has.
double lift_onto(dfm_context *context, const dfm_obstacle_def &on, double time,
                 const std::vector<double> &points, const double up_[3]) {
  Scratch scratch;
  const dfm_world_def empty = dfm_world_def_default();
  need(dfm_world_create(context, &empty, &scratch.world));
  resolve<World>(Kind::world, scratch.world).time = time;
  dfm_obstacle_def def = on;
  def.material = 0;
  dfm_obstacle obstacle = 0;
  need(dfm_obstacle_create(scratch.world, &def, &obstacle));
  dfm_pose pose = {};
  need(dfm_obstacle_get_pose(obstacle, &pose));
  const Vec3 up = load3(up_), origin = load3(pose.position);
  if (on.shape == DFM_SHAPE_PLANE) {
    const Vec3 normal = rotate(unit_quat(pose.rotation), {0, 0, 1});
    if (dot(normal, up) < kSteep)
      fail(DFM_E_ARG, "'%s' is a wall, on which nothing lies; name an obstacle whose upper side is level",
           on.name);
    return (dot(normal, origin) - along(normal, points).low) / dot(normal, up);
  }
  // from where all of them are above it to where all are below
  const Span body = along(up, points);
  const double reach = 1.001 * reach_of(on), height = body.high - body.low, at = dot(up, origin);
  const double raised = at + reach + 1e-3 * height - body.low;
  const Vec3 start = raised * up, path = -(2 * reach + height) * up;
  dfm_query_shape hull = dfm_query_shape_default();
  hull.shape = DFM_SHAPE_CONVEX;
  hull.npoint = uint32_t(points.size() / 3);
  hull.points = points.data();
  store3(hull.pose.position, start);
  double way[3];
  store3(way, path);
  dfm_query_hit hit = {};
  dfm_query_hits hits = {sizeof hits, sizeof hit, 1, 0, &hit};
  need(dfm_world_query(scratch.world, &hull, way, 0, nullptr, nullptr, &hits));
  if (hits.n == 0)
    fail(DFM_E_ARG, "the body is not above or below '%s'; move it there by its \"pose\"", on.name);
  return raised - hit.distance;
}

}  // namespace

dfm_pose put_on(dfm_context *context, const Definition &def, MeshFiles &files, const Body &b,
                const BodyMesh &mesh) {
  constexpr double kGap = 1e-4;  // of the body's size
  Obstacle o = *std::find_if(def.obstacles.begin(), def.obstacles.end(),
                             [&b](const Obstacle &it) { return it.name == b.on; });
  o.def.name = o.name.c_str();
  if (o.start) o.def.pose = *o.start;
  o.def.nkey = o.start ? 0 : uint32_t(o.keys.size());
  o.def.keys = o.keys.data();
  std::vector<double> scaled, points = mesh.wears_skin ? mesh.skin.points : mesh.points;
  if (!o.mesh.empty()) files.load(o, scaled);
  const Quat turn = unit_quat(b.def.pose.rotation);
  for (size_t i = 0; i < points.size(); i += 3)
    store3(&points[i], rotate(turn, load3(&points[i])) + load3(b.def.pose.position));
  const Vec3 down = load3(def.world.gravity);
  double up[3];
  store3(up, norm(down) > 0 ? (-1 / norm(down)) * down : Vec3{0, 0, 1});
  double lift = 0;
  try {
    lift = lift_onto(context, o.def, def.begin, points, up);
  } catch (const Error &e) {
    def.refuse(b.pointer + "/place", e.what(), e.status);
  }
  dfm_pose pose = b.def.pose;
  for (size_t k = 0; k < 3; ++k) pose.position[k] += (lift + kGap * mesh.size) * up[k];
  return pose;
}

}  // namespace dfm::scene
