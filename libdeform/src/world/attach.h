// Creating, ending and reporting attachments between two steps (deform/attach.h).
#pragma once
#include <cstdint>

#include "deform/attach.h"
#include "state/body.h"
#include "state/obstacle.h"

namespace dfm {

// Returns the number of the new attachment. One of `other` and `obstacle` is null. Throws Error; then nothing
// has changed.
uint32_t attach(Body &b, const dfm_attach_def &def, Body *other, const Obstacle *obstacle);
void detach(Body &b, uint32_t number);
dfm_attachment attachment_report(const Body &b, uint32_t number);

}  // namespace dfm
