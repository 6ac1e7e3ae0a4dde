/* V03: answers an id with a table that says nothing. */
#include "deform/plugin.h"
static const dfm_effects none = {sizeof(dfm_effects), 0, NULL};
#define TABLE_ID DFM_EXT_EFFECTS
#define TABLE &none
#include "stepper.h"
