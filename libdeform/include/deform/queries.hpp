// deform/queries.hpp -- queries, callbacks, sensors and vertices of deform.hpp, as bases of its classes.
// Included by deform.hpp.
#ifndef DEFORM_QUERIES_HPP
#define DEFORM_QUERIES_HPP
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "deform/deform.h"
#include "deform/result.hpp"

namespace deform {

struct QueryShape : dfm_query_shape {
  QueryShape() noexcept : dfm_query_shape(dfm_query_shape_default()) {}
};
struct QueryFilter : dfm_query_filter {
  QueryFilter() noexcept : dfm_query_filter(dfm_query_filter_default()) {}
};
struct VertexLayout : dfm_vertex_layout {
  VertexLayout() noexcept : dfm_vertex_layout(dfm_vertex_layout_default()) {}
};

namespace basic {

template <class E, class Self>
class WorldQueries {
 public:
  auto ray(In3 origin, In3 direction, double max_distance) const {
    return produce<E, dfm_ray_hit>([&](dfm_ray_hit &h) {
      h.size = sizeof h;
      return dfm_world_ray(world(), origin.data(), direction.data(), max_distance, &h);
    });
  }
  auto closest(In3 point, double max_distance) const {
    return produce<E, dfm_ray_hit>([&](dfm_ray_hit &h) {
      h.size = sizeof h;
      return dfm_world_closest(world(), point.data(), max_distance, &h);
    });
  }
  // filter nullptr: all but sensors.
  auto query_ray(In3 origin, In3 direction, double max_distance,
                 const dfm_query_filter *filter = nullptr) const {
    return hit([&](dfm_query_hit &h) {
      return dfm_world_query_ray(world(), origin.data(), direction.data(), max_distance, filter, &h);
    });
  }
  auto query_closest(In3 point, double max_distance, const dfm_query_filter *filter = nullptr) const {
    return hit([&](dfm_query_hit &h) {
      return dfm_world_query_closest(world(), point.data(), max_distance, filter, &h);
    });
  }
  auto query_cast(const dfm_query_shape &shape, In3 path, const dfm_query_filter *filter = nullptr) const {
    return hit(
        [&](dfm_query_hit &h) { return dfm_world_query_cast(world(), &shape, path.data(), filter, &h); });
  }
  // Into the caller's memory, the nearest ones, returning how many there are in all; or as a vector.
  auto query_ray_all(In3 origin, In3 direction, double max_distance, std::span<dfm_query_hit> out,
                     const dfm_query_filter *filter = nullptr) const {
    return produce<E, uint32_t>([&](uint32_t &n) {
      return dfm_world_query_ray_all(world(), origin.data(), direction.data(), max_distance, filter,
                                     rows(out.size(), 1), out.data(), &n);
    });
  }
  auto query_ray_all(In3 origin, In3 direction, double max_distance,
                     const dfm_query_filter *filter = nullptr) const {
    return produce<E, std::vector<dfm_query_hit>>([&](std::vector<dfm_query_hit> &out) {
      return whole(out, [&](uint32_t capacity, dfm_query_hit *to, uint32_t *n) {
        return dfm_world_query_ray_all(world(), origin.data(), direction.data(), max_distance, filter,
                                       capacity, to, n);
      });
    });
  }
  auto query_overlap(const dfm_query_shape &shape, std::span<uint64_t> out,
                     const dfm_query_filter *filter = nullptr) const {
    return produce<E, uint32_t>([&](uint32_t &n) {
      return dfm_world_query_overlap(world(), &shape, filter, rows(out.size(), 1), out.data(), &n);
    });
  }
  auto query_overlap(const dfm_query_shape &shape, const dfm_query_filter *filter = nullptr) const {
    return produce<E, std::vector<uint64_t>>([&](std::vector<uint64_t> &out) {
      return whole(out, [&](uint32_t capacity, uint64_t *to, uint32_t *n) {
        return dfm_world_query_overlap(world(), &shape, filter, capacity, to, n);
      });
    });
  }
  auto query_aabb(const dfm_aabb &box, const dfm_query_filter *filter = nullptr) const {
    return produce<E, std::vector<uint64_t>>([&](std::vector<uint64_t> &out) {
      return whole(out, [&](uint32_t capacity, uint64_t *to, uint32_t *n) {
        return dfm_world_query_aabb(world(), &box, filter, capacity, to, n);
      });
    });
  }

  // Functions of the host; nullptr: none.
  auto set_may_touch(dfm_may_touch_fn may_touch, void *user = nullptr) const {
    return E::done(dfm_world_set_may_touch(world(), may_touch, user));
  }
  auto ask_again(uint64_t a = 0, uint64_t b = 0) const { return E::done(dfm_world_ask_again(world(), a, b)); }
  auto set_pre_solve(dfm_pre_solve_fn pre_solve, void *user = nullptr) const {
    return E::done(dfm_world_set_pre_solve(world(), pre_solve, user));
  }

 private:
  dfm_world world() const noexcept { return static_cast<const Self *>(this)->get(); }
  template <class F>
  static auto hit(F &&f) {
    return produce<E, dfm_query_hit>([&](dfm_query_hit &h) {
      h.size = sizeof h;
      return f(h);
    });
  }
  // Asked for the number first.
  template <class T, class F>
  static dfm_status whole(std::vector<T> &out, F &&f) {
    uint32_t n = 0;
    const dfm_status s = f(0, nullptr, &n);
    if (s < 0 || n == 0) return s;
    out.resize(n);
    return f(n, out.data(), &n);
  }
};

// Of bodies, obstacles and rigid bodies.
template <class E, class Self>
class SensorQueries {
 public:
  auto is_sensor() const {
    return produce<E, bool>([&](bool &sensor) { return dfm_is_sensor(thing(), &sensor); });
  }
  auto sensed() const { return collect<E, 1>(dfm_sensor_things, thing()); }
  auto sensed(std::span<uint64_t> out) const { return fill<E, 1>(dfm_sensor_things, thing(), out); }

 private:
  uint64_t thing() const noexcept { return static_cast<const Self *>(this)->get(); }
};

template <class E, class Self>
class ObstacleQueries : public SensorQueries<E, Self> {
 public:
  auto set_sensor(bool sensor) const {
    return E::done(dfm_obstacle_set_sensor(static_cast<const Self *>(this)->get(), sensor));
  }
};

template <class E, class Self>
class BodyQueries : public SensorQueries<E, Self> {
 public:
  auto set_sensor(bool sensor) const { return E::done(dfm_body_set_sensor(body(), sensor)); }
  // Returns the number of vertices; an empty span only asks.
  auto surface_vertices(const dfm_vertex_layout &layout, std::span<std::byte> out) const {
    return produce<E, uint32_t>(
        [&](uint32_t &n) { return dfm_surface_vertices(body(), &layout, out.size(), out.data(), &n); });
  }
  // Into the caller's memory, the lowest numbers, returning how many there are in all.
  auto query_triangles(const dfm_query_shape &shape, std::span<uint32_t> out) const {
    return produce<E, uint32_t>([&](uint32_t &n) {
      return dfm_body_query_triangles(body(), &shape, rows(out.size(), 1), out.data(), &n);
    });
  }

 private:
  dfm_body body() const noexcept { return static_cast<const Self *>(this)->get(); }
};

}  // namespace basic
}  // namespace deform
#endif
