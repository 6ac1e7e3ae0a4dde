/* V03: a word in a row of effects that no host reads yet. */
#include "deform/plugin.h"
static const dfm_effect_row row = {"damping", 1, 5, 0.0};
static const dfm_effect_rows rows_of_effects = {sizeof(dfm_effect_rows), sizeof(dfm_effect_row), 1, 0, &row};
#define TABLE_ID DFM_EXT_EFFECT_ROWS
#define TABLE &rows_of_effects
#include "stepper.h"
