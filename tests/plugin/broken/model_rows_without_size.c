/* V03: nobody can tell its rows apart. */
#include "deform/plugin.h"
static const dfm_fact *list_facts(const void *self, uint32_t *n) {
  static const dfm_fact one = {"one", "the one", "1", 1};
  (void)self;
  *n = 1;
  return &one;
}
static const dfm_facts facts = {sizeof(dfm_facts), 0, list_facts};
#define TABLE_ID DFM_EXT_FACTS
#define TABLE &facts
#include "stepper.h"
