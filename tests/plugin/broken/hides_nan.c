/* V08: a normal force that is no number passes for an open contact. */
#include "base.h"

static void hides(struct lane *l) {
  if (!(l->fn > 0)) l->fn = 0;
  correct_lane(l);
}

#define LANE hides
#include "law.h"
