#include <cmath>
#include <cstddef>
#include <cstring>

#include "adapter.h"

using namespace dfm_ode_detail;

namespace {

template <class F>
dfm_status with(dfm_ode handle, F &&f) noexcept {
  return between_steps<Adapter>(ode_kind(), handle, f);
}

// Ends of structs in 0.1, the smallest that a caller may have (deform/base.h, "structs of another version").
constexpr uint32_t kFirstDef = offsetof(dfm_ode_def, version) + sizeof(const char *);
constexpr uint32_t kFirstStats = offsetof(dfm_ode_stats, ode_seconds) + sizeof(double);

bool same_version(const char *a, const char *b) { return a && std::strncmp(a, b, 5) == 0; }  // "0.16."

dfm_status check_def(const dfm_ode_def &d) {
  if (d.size < kFirstDef)
    return failed(DFM_E_ARG, "dfm_ode_def: size is %u, expected %zu; start from dfm_ode_def_default()",
                  d.size, sizeof d);
  if (d.real_bytes != sizeof(dReal) || !same_version(d.version, dODE_VERSION))
    return failed(DFM_E_UNSUPPORTED,
                  "this program was compiled against ODE %s with a dReal of %u bytes, libdeform_ode against "
                  "ODE %s with %zu; compile both against the same",
                  d.version ? d.version : "?", d.real_bytes, dODE_VERSION, sizeof(dReal));
  if (const dfm_status s = check_ode(); s != DFM_OK) return s;
  if (!d.world || !d.space)
    return failed(DFM_E_ARG, "dfm_ode_def: %s is NULL; set it to that of your scene",
                  d.world ? "space" : "world");
  if (d.flags & ~uint32_t{DFM_ODE_QUICK})
    return failed(DFM_E_ARG, "dfm_ode_def: flags %u; only DFM_ODE_QUICK is known", d.flags);
  if (!(d.friction >= 0 && std::isfinite(d.friction)))
    return failed(DFM_E_ARG, "dfm_ode_def: friction %g; it must be finite and not negative", d.friction);
  if (d.most_contacts < 1 || d.most_contacts > 64)
    return failed(DFM_E_ARG, "dfm_ode_def: most_contacts %u; between 1 and 64", d.most_contacts);
  return DFM_OK;
}

}  // namespace

namespace dfm_ode_detail {

const EngineKind &ode_kind() {
  static const EngineKind kind{"ode", "dfm_ode_step", create_own_world};
  return kind;
}

dfm_status check_ode() {
  if (sizeof(dReal) != 8 || !dCheckConfiguration("ODE_double_precision"))
    return failed(DFM_E_UNSUPPORTED,
                  "the ODE that is loaded is not of double precision (%s); libdeform_ode needs libode-dev "
                  "0.16 as Debian builds it",
                  dGetConfiguration());
  if (!dCheckConfiguration("ODE_EXT_trimesh"))
    return failed(DFM_E_UNSUPPORTED,
                  "the ODE that is loaded has no triangle meshes (%s); libdeform_ode needs libode-dev 0.16 "
                  "as Debian builds it",
                  dGetConfiguration());
  return DFM_OK;
}

}  // namespace dfm_ode_detail

void dfm_ode_def_default_sized(uint32_t real_bytes, const char *version, uint32_t size, dfm_ode_def *out) {
  if (!out) return;
  dfm_ode_def d{};
  d.friction = 0.5;
  d.most_contacts = 8;
  d.real_bytes = real_bytes;
  d.version = version;
  write_sized(out, d, size);
}

dfm_status dfm_ode_register(void) {
  if (const dfm_status s = check_ode(); s != DFM_OK) return s;
  return register_host(ode_kind());
}

dfm_status dfm_ode_attach(dfm_world world, const dfm_ode_def *def, dfm_ode *out) {
  return attach<Adapter>(ode_kind(), world, def, out, check_def);
}

dfm_status dfm_ode_detach(dfm_ode ode) { return detach<Adapter>(ode_kind(), ode); }

dfm_status dfm_ode_step(dfm_ode ode, double dt) {
  return with(ode, [&](Adapter &a) {
    if (!(dt > 0 && std::isfinite(dt)))
      return failed(DFM_E_ARG, "dt %g s; it must be positive and finite", dt);
    return a.step(dt);
  });
}

dfm_status dfm_ode_trouble(dfm_ode ode, uint32_t *trouble) {
  return with(ode, [&](Adapter &a) {
    if (!trouble) return missing("trouble");
    *trouble = a.trouble;
    return dfm_status{DFM_OK};
  });
}

dfm_status dfm_ode_get_stats(dfm_ode ode, dfm_ode_stats *out) {
  return with(ode, [&](Adapter &a) { return give(out, a.stats(), kFirstStats); });
}

dfm_status dfm_ode_obstacle(dfm_ode ode, dGeomID geom, dfm_obstacle *out) {
  return with(ode, [&](Adapter &a) {
    return !geom ? missing("geom") : !out ? missing("out") : a.obstacle(geom, out);
  });
}

dfm_status dfm_ode_rigid(dfm_ode ode, dBodyID body, dfm_rigid *out) {
  return with(ode, [&](Adapter &a) {
    return !body ? missing("body") : !out ? missing("out") : a.rigid(body, out);
  });
}

dfm_status dfm_ode_set_geom(dfm_ode ode, dGeomID geom, const dfm_ode_geom *props) {
  return with(ode, [&](Adapter &a) {
    return !geom ? missing("geom") : !props ? missing("props") : a.set_geom(geom, *props);
  });
}

dfm_status dfm_ode_set_convex(dfm_ode ode, dGeomID geom, uint32_t npoint, const double *points,
                              uint32_t npolygon, const uint32_t *polygons) {
  return with(ode, [&](Adapter &a) {
    if (!geom || !points || !polygons) return missing(!geom ? "geom" : !points ? "points" : "polygons");
    std::string wrong;
    Triangles t = convex_triangles(npoint, points, npolygon, polygons, wrong);
    if (!wrong.empty()) return failed(DFM_E_ARG, "convex: %s", wrong.c_str());
    return a.set_arrays(geom, dConvexClass, std::move(t));
  });
}

dfm_status dfm_ode_set_heights(dfm_ode ode, dGeomID geom, double width, double depth, uint32_t nx,
                               uint32_t nz, const double *heights) {
  return with(ode, [&](Adapter &a) {
    if (!geom || !heights) return missing(!geom ? "geom" : "heights");
    if (nx < 2 || nz < 2 || !(width > 0) || !(depth > 0))
      return failed(DFM_E_ARG,
                    "heightfield: %u by %u samples over %g by %g m; at least 2 by 2 over a positive size", nx,
                    nz, width, depth);
    return a.set_arrays(geom, dHeightfieldClass, height_triangles(width, depth, nx, nz, heights));
  });
}

dfm_status dfm_ode_refresh(dfm_ode ode, dGeomID geom) {
  return with(ode, [&](Adapter &a) { return !geom ? missing("geom") : a.refresh(geom); });
}

dfm_status dfm_ode_snapshot(dfm_ode ode, void *buffer, size_t *bytes) {
  return with(ode, [&](Adapter &a) { return !bytes ? missing("bytes") : a.snapshot(buffer, bytes); });
}

dfm_status dfm_ode_restore(dfm_ode ode, const void *buffer, size_t bytes) {
  return with(ode, [&](Adapter &a) { return !buffer ? missing("buffer") : a.restore(buffer, bytes); });
}

dfm_status dfm_ode_set_friction(dfm_ode ode, dfm_context *context, const char *law, const dfm_params *params,
                                double area) {
  return with(ode, [&](Adapter &a) {
    if (!law) {
      a.friction().clear_law();
      return dfm_status{DFM_OK};
    }
    return !context ? missing("context") : a.friction().set_law(context, law, params, area);
  });
}

dfm_status dfm_ode_contact(dfm_ode ode, dGeomID a, dGeomID b, int *made) {
  return dfm_rigid_detail::with<Adapter>(ode_kind(), ode, [&](Adapter &adapter) {
    if (!a || !b) return missing(!a ? "a" : "b");
    if (dGeomIsSpace(a) || dGeomIsSpace(b))
      return failed(DFM_E_ARG, "a space is no geom; dSpaceCollide2 finds the geoms in it");
    const int n = adapter.friction().collide(a, b, adapter.friction().h);
    if (made) *made = n;
    return dfm_status{DFM_OK};
  });
}
