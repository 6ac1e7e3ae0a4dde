// What a shape, a ray or a point meets among bodies, obstacles and rigid bodies: dfm_world_query, for checked
// arguments.
#pragma once
#include "deform/query.h"
#include "geometry/convex_search.h"
#include "state/obstacle.h"
#include "state/world.h"

namespace dfm {

// Either of the two.
struct Thing {
  Body *body = nullptr;
  Obstacle *obstacle = nullptr;
  uint64_t handle() const { return body ? body->handle : obstacle->handle; }
  uint64_t id() const { return body ? body->id : obstacle->id; }
  bool sensor() const { return body ? body->sensor : obstacle->sensor; }
  uint32_t category() const { return body ? body->category : obstacle->def.category; }
  uint32_t collides_with() const { return body ? body->collides_with : obstacle->def.collides_with; }
};

// given null: all but sensors.
class ThingFilter {
 public:
  explicit ThingFilter(const dfm_query_filter *given) : given_(given) {}
  bool passes(const Thing &thing) const;

 private:
  const dfm_query_filter *given_;
};

// Calls f(thing) for all that pass, bodies first, each kind in order of creation, until f returns false.
template <class F>
void each_thing(World &w, const ThingFilter &filter, F &&f) {
  for (auto &b : w.bodies)
    if (const Thing thing{b.get(), nullptr}; filter.passes(thing) && !f(thing)) return;
  for (auto &o : w.obstacles)
    if (const Thing thing{nullptr, o.get()}; filter.passes(thing) && !f(thing)) return;
}

// Whether two things overlap. Two planes do not.
bool overlap(const Thing &a, const Thing &b);

// m, signed distance of a point from the surface of an obstacle, negative inside a sphere, box or capsule;
// `limit` if it is farther.
double distance_from(Obstacle &o, Vec3 p, double limit);

struct ThingQuery {
  Convex shape;
  bool point = false;  // of no size, and what encloses it does not count: a ray, or the closest point
  bool each = false;   // all hits of a thing, in place of its nearest
  ShapeWay way;
  double limit = kFar;  // m, along the way or from the shape
  SearchCount *count = nullptr;
};
// Calls hit() as dfm_world_query does. Several threads may query at once. The first query after positions
// have changed refits the trees (state/search_tree.h); later ones do not allocate.
void find(World &w, const ThingFilter &filter, const ThingQuery &query, dfm_query_hit_fn hit, void *user);
// A hit() whose user is a dfm_query_hits of some capacity; one that counts all hits, also those that the list
// has no room for.
double keep_nearest(void *user, const dfm_query_hit *hit);
double keep_and_count(void *user, const dfm_query_hit *hit);

}  // namespace dfm
