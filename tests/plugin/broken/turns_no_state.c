/* F02: declares its bristle as two numbers, so the host does not turn it with the frame of the contact. */
#include "base.h"

#define SLOTS {DFM_PER_CONTACT, 2, DFM_SLOT_SCALAR, 0}
#include "law.h"
