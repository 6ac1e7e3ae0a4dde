/* M23: a part is left out, and its points stay where they were. */
#include "deform/plugin.h"
#include "deform/plugin_draft.h"
static uint32_t parts(const void *self);
static dfm_status part_forces(void *self, const dfm_kin *kin, uint32_t single, dfm_take_part_fn take,
                              void *user);
static const dfm_part_forces table = {sizeof(dfm_part_forces), 0, parts, part_forces};
#define BY_PART &table
#include "net.h"
/* The points from the first on are one part, the last point another one. */
static uint32_t parts(const void *self) {
  (void)self;
  return 2;
}
static dfm_status part_forces(void *self, const dfm_kin *kin, uint32_t single, dfm_take_part_fn take,
                              void *user) {
  Net *net = self;
  double *f = calloc(4 * (size_t)net->npoint, sizeof *f);
  uint32_t *point = malloc(net->npoint * sizeof *point);
  dfm_kin at = *kin;
  double *wide;
  (void)single;
  wide = calloc((size_t)kin->stride * net->npoint, sizeof *wide);
  if (f && point && wide) {
    add_forces(self, &at, wide);
    for (uint32_t i = 0; i < net->npoint; ++i) {
      point[i] = i;
      for (int k = 0; k < 3; ++k) f[4 * (size_t)i + k] = wide[(size_t)kin->stride * i + k];
    }
    take(user, 0, net->npoint - 1, point, f);
  }
  free(f);
  free(point);
  free(wide);
  return DFM_OK;
}
