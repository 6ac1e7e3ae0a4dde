/* A law that ends its process, or never comes back, in the way that its parameter says, at the third
 * hundredth call. */
#define _DEFAULT_SOURCE
#define _ISOC11_SOURCE /* quick_exit */
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include "deform/plugin.h"

enum {
  RETURNS,
  EXITS,
  UNDERSCORE_EXITS,
  QUICK_EXITS,
  ABORTS,
  ENDS_ITS_THREAD,
  TOUCHES_NOTHING,
  HANGS,
  WAITS
};

static void leave(int way) {
  volatile int round = 1;
  volatile uintptr_t nowhere = 8;
  if (way == EXITS) exit(0);
  if (way == UNDERSCORE_EXITS) _exit(0);
  if (way == QUICK_EXITS) quick_exit(0);
  if (way == ABORTS) abort();
  if (way == ENDS_ITS_THREAD) pthread_exit(NULL);
  if (way == TOUCHES_NOTHING) *(volatile int *)nowhere = 1;
  while (way == HANGS) round = round % 1000 + 1;
  while (way == WAITS) pause();
}

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  static unsigned calls;
  uint32_t i, k;
  if (++calls == 300) leave((int)in->params[0]);
  for (i = 0; i < in->n; ++i) {
    for (k = 0; k < 2; ++k) {
      if (out->ft) out->ft[k * in->stride + i] = -in->vt[k * in->stride + i];
      if (out->dft_dfn) out->dft_dfn[k * in->stride + i] = 0;
    }
    for (k = 0; out->dft_dvt && k < 4; ++k) out->dft_dvt[k * in->stride + i] = k % 3 == 0 ? -1 : 0;
    if (out->limit) out->limit[i] = HUGE_VAL;
    if (out->mode) out->mode[i] = 2;
  }
  return DFM_OK;
}

static const dfm_param rows[] = {{"way", "how it leaves", "1", 0, 8, 0, DFM_PARAM_INTEGER, 1, NULL}};
#define ID "org.tiny.leaves"
#define NEEDS DFM_NEED_VT
#define CLAIMS (DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN)
#include "law_type.h"
