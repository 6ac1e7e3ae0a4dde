// The service "dfm.direct/1" that plugins may ask a host for (deform/plugin_draft.h).
#pragma once
#include "deform/plugin_draft.h"

namespace dfm {

// Depends on the host alone that its analyse() is given.
const dfm_direct &direct_service();

}  // namespace dfm
