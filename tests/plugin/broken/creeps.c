/* F06: the bristle relaxes by a millionth each second, which nobody sees in a short test. */
#include "base.h"

static void creeps(struct lane *l) {
  correct_lane(l);
  for (int a = 0; a < 2; ++a) l->next[a] /= 1 + 1e-6 * l->h;
  finish(l, l->mode == 2);
}

#define LANE creeps
#include "law.h"
