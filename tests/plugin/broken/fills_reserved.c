/* V03: a word in a slot that no host reads yet. */
#define SLOTS {DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 9}
#include "law.h"
