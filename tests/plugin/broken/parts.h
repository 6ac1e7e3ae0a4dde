/* A net whose forces are given in two parts: the last point, and all others. A file that includes this
 * defines give_last, which breaks a promise. */
#include "deform/plugin.h"
#include "deform/plugin_draft.h"
static uint32_t parts(const void *self);
static dfm_status part_forces(void *self, const dfm_kin *kin, uint32_t single, dfm_take_part_fn take,
                              void *user);
static const dfm_part_forces table = {sizeof(dfm_part_forces), 0, parts, part_forces};
#define BY_PART &table
#include "net.h"
/* Gives the part of the last point; f [4] N. */
static void give_last(dfm_take_part_fn take, void *user, const uint32_t *point, double *f);
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
    give_last(take, user, point + net->npoint - 1, f + 4 * (size_t)(net->npoint - 1));
  }
  free(f);
  free(point);
  free(wide);
  return DFM_OK;
}
