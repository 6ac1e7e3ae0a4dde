// Overlaps, casts and all-hits queries of a shape, a ray or a point among bodies, obstacles and rigid bodies:
// the functions of deform/query.h, for checked arguments.
#pragma once
#include "deform/query.h"
#include "geometry/convex_gap.h"
#include "geometry/triangle_search.h"
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

// A sphere, capsule or box as a convex shape.
Convex convex_of(const Obstacle &o);
bool is_convex(const Obstacle &o);

// Whether it touches the surface of the thing, or is inside it.
bool overlaps(const Convex &shape, const Thing &thing);
// Whether two things overlap. Two planes do not.
bool overlap(const Thing &a, const Thing &b);

dfm_query_hit find_first_on_ray(World &w, const ThingFilter &filter, Vec3 origin, Vec3 unit, double limit);
dfm_query_hit find_closest(World &w, const ThingFilter &filter, Vec3 p, double limit);
// m, signed distance of a point from the surface of an obstacle, negative inside a sphere, box or capsule;
// `limit` if it is farther.
double distance_from(Obstacle &o, Vec3 p, double limit);
dfm_query_hit find_first_on_path(World &w, const ThingFilter &filter, const Convex &shape, Vec3 path);
// Writes all hits into the caller's rows: nearest first, then by thing, then by triangle.
class HitRows {
 public:
  HitRows(dfm_query_hit *out, uint32_t row_size, uint32_t capacity)
      : at_(reinterpret_cast<unsigned char *>(out)), step_(row_size), capacity_(capacity) {}
  void offer(const dfm_query_hit &hit);  // things in their order
  uint32_t count() const { return count_; }

 private:
  bool before(const dfm_query_hit &hit, uint32_t row) const;
  unsigned char *at_;
  uint32_t step_, capacity_, count_ = 0;
};
void find_all_on_ray(World &w, const ThingFilter &filter, Vec3 origin, Vec3 unit, double limit,
                     HitRows &rows);

}  // namespace dfm
