// deform/queries.hpp -- queries, callbacks, sensors and vertices of deform.hpp, as bases of its classes.
// Included by deform.hpp.
#ifndef DEFORM_QUERIES_HPP
#define DEFORM_QUERIES_HPP
#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <tuple>
#include <type_traits>
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
  // found(const dfm_query_hit &) returns how far to go on, as a dfm_query_hit_fn.
  template <class F>
    requires std::invocable<F &, const dfm_query_hit &>
  auto query(const dfm_query_shape &shape, std::optional<In3> path, double reach,
             const dfm_query_filter *filter, F &&found) const {
    return E::done(each_hit(shape, path, reach, filter, found));
  }
  // The nearest hits, nearest first: into the caller's memory, returning their number; or all as a vector.
  auto query(const dfm_query_shape &shape, std::optional<In3> path, double reach,
             std::span<dfm_query_hit> out, const dfm_query_filter *filter = nullptr) const {
    return produce<E, uint32_t>([&](uint32_t &n) { return hits(shape, path, reach, filter, out, n); });
  }
  auto query(const dfm_query_shape &shape, std::optional<In3> path = {}, double reach = 0,
             const dfm_query_filter *filter = nullptr) const {
    return produce<E, std::vector<dfm_query_hit>>([&](std::vector<dfm_query_hit> &out) {
      // one query, so the filter's function is asked once; `reserved` numbers the things until all are sorted
      const dfm_status s = each_hit(shape, path, reach, filter, [&](const dfm_query_hit &h) {
        const bool same = !out.empty() && out.back().thing == h.thing;
        const uint32_t number = out.empty() ? 0 : out.back().reserved + !same;
        out.push_back(h);
        out.back().reserved = number;
        return HUGE_VAL;
      });
      std::sort(out.begin(), out.end(), [](const dfm_query_hit &a, const dfm_query_hit &b) {
        return std::tie(a.distance, a.reserved, a.triangle) < std::tie(b.distance, b.reserved, b.triangle);
      });
      for (dfm_query_hit &h : out) h.reserved = 0;
      return s;
    });
  }
  // The nearest hit; where there is none its thing is 0 and its distance infinite.
  auto query_first(const dfm_query_shape &shape, std::optional<In3> path = {}, double reach = 0,
                   const dfm_query_filter *filter = nullptr) const {
    return produce<E, dfm_query_hit>([&](dfm_query_hit &out) {
      uint32_t n = 0;
      out = {};
      out.size = sizeof out;
      out.triangle = UINT32_MAX;
      out.distance = HUGE_VAL;
      return hits(shape, path, reach, filter, {&out, 1}, n);
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
  dfm_status each_hit(const dfm_query_shape &shape, std::optional<In3> path, double reach,
                      const dfm_query_filter *filter, F &&found) const {
    double next = -1;
    const auto ask = [&](const dfm_query_hit &h) { next = found(h); };
    struct To {
      typename E::template Call<decltype(ask)> call;
      double &next;
    } to{{ask}, next};
    const dfm_status s = dfm_world_query(
        world(), &shape, path ? path->data() : nullptr, reach, filter,
        [](void *user, const dfm_query_hit *h) -> double {
          To &t = *static_cast<To *>(user);
          t.next = -1;  // what it is after a throw
          t.call(*h);
          return t.next;
        },
        &to);
    to.call.rethrow();
    return s;
  }
  dfm_status hits(const dfm_query_shape &shape, std::optional<In3> path, double reach,
                  const dfm_query_filter *filter, std::span<dfm_query_hit> out, uint32_t &n) const noexcept {
    dfm_query_hits to{sizeof to, sizeof(dfm_query_hit), rows(out.size(), 1), 0, out.data()};
    const dfm_status s =
        dfm_world_query(world(), &shape, path ? path->data() : nullptr, reach, filter, nullptr, &to);
    n = to.n;
    return s;
  }
};

// What bodies, obstacles and rigid bodies say about sensors.
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
        [&](uint32_t &n) { return dfm_surface_vertices(body(), &layout, out.size(), given(out), &n); });
  }

 private:
  dfm_body body() const noexcept { return static_cast<const Self *>(this)->get(); }
};

}  // namespace basic
}  // namespace deform
#endif
