#include "deform/toi.h"

#include <cmath>
#include <cstring>

#include "api/objects.h"
#include "ccd/toi.h"

namespace dfm {
namespace {

thread_local uint32_t last_evaluations = 0;

dfm_toi_options checked(const char *function, const dfm_toi_options *given) {
  dfm_toi_options usual{};
  usual.method = DFM_TOI_CONSERVATIVE;
  const dfm_toi_options o = take_def(given, usual);
  if (o.method < DFM_TOI_BISECTION || o.method > DFM_TOI_CONSERVATIVE)
    fail(DFM_E_ARG, "%s: options.method is %d, expected DFM_TOI_BISECTION (0) to DFM_TOI_CONSERVATIVE (3)",
         function, o.method);
  if (!(o.tolerance >= 0 && o.tolerance < 1))
    fail(DFM_E_ARG, "%s: options.tolerance is %g, expected at least 0 (0: 1e-12) and below 1", function,
         o.tolerance);
  if (!(o.min_separation >= 0 && std::isfinite(o.min_separation)))
    fail(DFM_E_ARG, "%s: options.min_separation is %g m, expected a finite distance of at least 0", function,
         o.min_separation);
  if (o.max_iterations < 0)
    fail(DFM_E_ARG, "%s: options.max_iterations is %d, expected at least 0 (0: the default)", function,
         o.max_iterations);
  return o;
}

void check(const char *function, const char *name, const dfm_motion *motion, int n) {
  if (!motion) fail(DFM_E_ARG, "%s: %s is NULL", function, name);
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < 3; ++i)
      for (const double *end : {motion[k].p0, motion[k].p1})
        if (!std::isfinite(end[i]))
          fail(DFM_E_ARG, "%s: %s[%d].%s[%d] is %g, expected a finite coordinate", function, name, k,
               end == motion[k].p0 ? "p0" : "p1", i, end[i]);
}

void copy_out(const ToiHit &hit, double *t, double *at, int n) {
  last_evaluations = hit.evaluations;
  *t = hit.t;
  if (at && hit.t <= 1) std::memcpy(at, hit.at, sizeof(double) * size_t(n));
}

}  // namespace
}  // namespace dfm

using namespace dfm;

dfm_status dfm_toi_point_triangle(const dfm_motion *p, const dfm_motion tri[3],
                                  const dfm_toi_options *options, double *t, double bary[3]) {
  return as_status([&] {
    const char *const name = "dfm_toi_point_triangle";
    const dfm_toi_options o = checked(name, options);
    check(name, "p", p, 1);
    check(name, "tri", tri, 3);
    need(t, "t");
    copy_out(dfm::toi_point_triangle(*p, tri, o), t, bary, 3);
  });
}

dfm_status dfm_toi_edge_edge(const dfm_motion a[2], const dfm_motion b[2], const dfm_toi_options *options,
                             double *t, double ab[2]) {
  return as_status([&] {
    const char *const name = "dfm_toi_edge_edge";
    const dfm_toi_options o = checked(name, options);
    check(name, "a", a, 2);
    check(name, "b", b, 2);
    need(t, "t");
    copy_out(dfm::toi_edge_edge(a, b, o), t, ab, 2);
  });
}

uint32_t dfm_toi_evaluations(void) { return last_evaluations; }
