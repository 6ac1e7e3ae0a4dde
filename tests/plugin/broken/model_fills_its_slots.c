/* V03: a word in the table of its state that no host reads yet. */
#include "deform/plugin.h"
static const dfm_slot one = {DFM_PER_INSTANCE, 1, DFM_SLOT_SCALAR, 0};
static const dfm_slots slots = {sizeof(dfm_slots), 1, &one, sizeof(dfm_slot), 7};
#define TABLE_ID DFM_EXT_SLOTS
#define TABLE &slots
#include "stepper.h"
