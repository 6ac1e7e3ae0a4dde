// The service "dfm.direct/1" for plugins (deform/plugin_draft.h).
#pragma once
#include "deform/plugin_draft.h"

namespace dfm {

// Depends only on the host that is passed to analyse().
const dfm_direct &direct_service();

}  // namespace dfm
