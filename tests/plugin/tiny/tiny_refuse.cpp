// Built against a later draft of the header: it refuses this library by itself, as plugin.hpp does it.
#include "deform/plugin.h"
#undef DFM_ABI_DRAFT
#define DFM_ABI_DRAFT 99u
#include "deform/plugin.hpp"

namespace {
dfm_status eval(const dfm_friction_in *, dfm_friction_out *) { return DFM_OK; }
const dfm_friction law = dfm::plugin::friction(0, 0, eval);
const dfm_type type =
    dfm::plugin::type(DFM_KIND_FRICTION, "org.tiny.later", "later", "1.0", "MIT", "test", nullptr, &law);
}  // namespace
DFM_PLUGIN(&type)
