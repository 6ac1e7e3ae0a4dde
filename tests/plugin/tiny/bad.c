/* One plugin per mistake in the self-description; the library refuses each with a sentence. */
#include "deform/plugin.h"

#ifdef BAD_NO_SOURCE
#define SOURCE ""
#else
#define SOURCE "test"
#endif
#ifdef BAD_BAD_ID
#define ID "just a name"
#else
#define ID "org.tiny.bad"
#endif
#ifdef BAD_BAD_RANGE
#define DEFAULT 11.0
#else
#define DEFAULT 1.0
#endif
#ifdef BAD_DOUBLE_KEY
#define SECOND "first"
#else
#define SECOND "second"
#endif
#ifdef BAD_FOREIGN_SLOT
#define UNIT DFM_PER_CELL
#else
#define UNIT DFM_PER_CONTACT
#endif
#ifdef BAD_FOREIGN_NEED
#define NEEDS 64
#else
#define NEEDS 0
#endif
#ifdef BAD_FOREIGN_CLAIM
#define FLAGS 0x10000
#else
#define FLAGS 0x8000 /* of a later header too, to be passed over */
#endif
#ifdef BAD_FOREIGN_FLAG
#define ROW_FLAGS 0x80000000u
#else
#define ROW_FLAGS 0x8000u
#endif
#ifdef BAD_SHORT_SLOT
#define SLOT_SIZE 12
#else
#define SLOT_SIZE 0
#endif
#ifdef BAD_UNKNOWN_KIND
#define KIND 4
#else
#define KIND DFM_KIND_FRICTION
#endif
#ifdef BAD_NO_EVAL
#define EVAL NULL
#else
#define EVAL eval
static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  (void)in;
  (void)out;
  return DFM_OK;
}
#endif

static const dfm_param rows[] = {{"first", "first", "N", 0.0, 10.0, DEFAULT, ROW_FLAGS, 1, NULL},
                                 {SECOND, "second", "N", 0.0, 10.0, 2.0, 0, 1, NULL}};
static const dfm_slot slots[] = {{UNIT, 2, DFM_SLOT_TANGENT, 0}};
static const dfm_friction law = {
    sizeof(dfm_friction), NEEDS, FLAGS, 1, slots, EVAL, NULL, NULL, NULL, NULL, SLOT_SIZE, 0, NULL};
static const dfm_type type = {sizeof(dfm_type),  KIND, ID,  "bad", "1.0", "MIT", SOURCE, rows, 2,
                              sizeof(dfm_param), NULL, &law};
#include "../one_type.h"
