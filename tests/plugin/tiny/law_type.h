/* The rest of a law, after `rows` and `eval`: ID and NEEDS, and what others lack, each a macro. */
#ifndef CLAIMS
#define CLAIMS (DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE)
#endif
#ifndef EFFECTS
#define EFFECTS NULL
#endif
#ifndef SOURCE
#define SOURCE "test"
#endif
#ifndef SLOTS /* with NSLOT */
#define NSLOT 0
#define SLOTS NULL
#endif
static const dfm_friction law = {
    sizeof(dfm_friction), NEEDS, CLAIMS, NSLOT, SLOTS, eval, NULL, NULL, NULL, NULL, 0, 0, NULL};
static const char *const effects[] = {EFFECTS};
static const dfm_type type = {sizeof(dfm_type),
                              DFM_KIND_FRICTION,
                              ID,
                              "of the tests",
                              "1.0",
                              "MIT",
                              SOURCE,
                              rows,
                              sizeof rows / sizeof rows[0],
                              sizeof(dfm_param),
                              effects,
                              &law};
#include "../one_type.h"
