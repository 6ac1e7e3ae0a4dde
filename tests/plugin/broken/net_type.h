/* The type of a broken model, after its functions. */
#ifndef CELLS
#define CELLS DFM_CELL_TET
#endif
#ifndef SLOTS /* of its state; with NSLOT */
#define NSLOT 0
#define SLOTS NULL
#endif
static const dfm_model model = {
    sizeof(dfm_model), CAPS,        CELLS,   NSLOT,     SLOTS,     create, destroy, NULL, NULL,
    ADDS_FORCES,       WITH_ENERGY, pattern, stiffness, extension, 0,      0};
static const char *const effects[] = {"damping", NULL};
static const dfm_type type = {sizeof(dfm_type),
                              DFM_KIND_MODEL,
                              "org.broken.model",
                              "a model of the tests",
                              "1.0",
                              "MIT",
                              "test",
                              rows,
                              2,
                              sizeof(dfm_param),
                              effects,
                              &model};
#include "../one_type.h"
