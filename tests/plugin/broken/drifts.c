/* F13: Dahl's law promises what only laws with an elastic zone can keep. */
#include "base.h"

static void drifts(struct lane *l) {
  project(l);
  dahl(l);
}

#define EFFECTS "stiction", "presliding", "hysteresis"
#define FLAGS (DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE)
#define LANE drifts
#include "law.h"
