// deform/ode.hpp -- deform/ode.h for C++20, in the manner of deform.hpp: Unique<Ode> detaches, errors come as
// exceptions or as values.
//
//   deform::OdeDef def;
//   def.world = ode_world, def.space = ode_space;
//   const auto ode = deform::attach_ode(world, def);   // declared after `world`, so that it ends before it
//   for (;;) ode.step(1.0 / 240);
#ifndef DEFORM_ODE_HPP
#define DEFORM_ODE_HPP
#include "deform/deform.hpp"
#include "deform/ode.h"

namespace deform {

// dfm_ode_def_default().
struct OdeDef : dfm_ode_def {
  OdeDef() noexcept : dfm_ode_def(dfm_ode_def_default()) {}
};
struct OdeGeom : dfm_ode_geom {
  OdeGeom() noexcept : dfm_ode_geom(sized<dfm_ode_geom>()) {}
};

namespace basic {

template <class E>
class Ode : public Handle<dfm_ode, struct OdeKind> {
 public:
  using Handle::Handle;
  // "ode" for scenes and World::add_rigids
  static auto register_host() { return E::done(dfm_ode_register()); }
  static void end(dfm_ode ode) noexcept { dfm_ode_detach(ode); }
  static auto attach(World<E> world, const dfm_ode_def &def) {
    return produce<E, Unique<Ode>>([&](auto &o) { return dfm_ode_attach(world.get(), &def, o.put()); });
  }
  auto detach() const { return E::done(dfm_ode_detach(raw_)); }
  auto step(double dt) const {
    return produce<E, StepReport>([&](StepReport &r) {
      const dfm_status s = dfm_ode_step(raw_, dt);
      r.discarded = s == DFM_DISCARD;
      if (s >= 0) dfm_ode_trouble(raw_, &r.trouble);
      return s;
    });
  }
  auto stats() const {
    return produce<E, dfm_ode_stats>([&](dfm_ode_stats &s) {
      s.size = sizeof s;
      return dfm_ode_get_stats(raw_, &s);
    });
  }
  // What stands for a geom and for a body in reports, rules and rays.
  auto obstacle(dGeomID geom) const {
    return produce<E, Obstacle<E>>([&](Obstacle<E> &o) { return dfm_ode_obstacle(raw_, geom, o.put()); });
  }
  auto rigid(dBodyID body) const {
    return produce<E, Rigid<E>>([&](Rigid<E> &r) { return dfm_ode_rigid(raw_, body, r.put()); });
  }
  // Both worlds, as World has it: returns the bytes used; an empty span only asks how many are needed.
  auto snapshot(std::span<std::byte> out) const {
    return produce<E, size_t>([&](size_t &bytes) {
      bytes = out.size();
      return dfm_ode_snapshot(raw_, given(out), &bytes);
    });
  }
  auto restore(std::span<const std::byte> from) const {
    return E::done(dfm_ode_restore(raw_, from.data(), from.size()));
  }
  // Of ODE's own contacts; nullptr: OdeDef.friction again.
  auto set_friction(Context<E> context, Text law, const dfm_params &params = {}, double area = 1) const {
    return E::done(
        dfm_ode_set_friction(raw_, context.get(), law.c_str, params.size ? &params : nullptr, area));
  }
  // In a near callback of one's own: contact joints made.
  auto contact(dGeomID a, dGeomID b) const {
    return produce<E, int>([&](int &made) { return dfm_ode_contact(raw_, a, b, &made); });
  }
  auto set_geom(dGeomID geom, const dfm_ode_geom &props) const {
    return E::done(dfm_ode_set_geom(raw_, geom, &props));
  }
  // points [n,3]; polygons: number of corners, then corners, for each of `count`.
  auto set_convex(dGeomID geom, std::span<const double> points, uint32_t count,
                  std::span<const uint32_t> polygons) const {
    size_t end = 0;
    uint32_t f = 0;
    for (; f < count && end < polygons.size(); ++f) end += size_t{1} + polygons[end];
    return E::done(
        f < count || end > polygons.size()
            ? spans_disagree
            : dfm_ode_set_convex(raw_, geom, rows(points.size(), 3), points.data(), count, polygons.data()));
  }
  // heights [nz,nx].
  auto set_heights(dGeomID geom, double width, double depth, uint32_t nx, uint32_t nz,
                   std::span<const double> heights) const {
    return E::done(heights.size() < size_t{nx} * nz
                       ? spans_disagree
                       : dfm_ode_set_heights(raw_, geom, width, depth, nx, nz, heights.data()));
  }
  auto refresh(dGeomID geom) const { return E::done(dfm_ode_refresh(raw_, geom)); }
};

}  // namespace basic

namespace values {
using Ode = basic::Ode<Values>;
inline auto attach_ode(World world, const dfm_ode_def &def) { return Ode::attach(world, def); }
}  // namespace values
#if defined(__cpp_exceptions)
namespace exceptions {
using Ode = basic::Ode<Throw>;
inline auto attach_ode(World world, const dfm_ode_def &def) { return Ode::attach(world, def); }
}  // namespace exceptions
#endif

}  // namespace deform
#endif
