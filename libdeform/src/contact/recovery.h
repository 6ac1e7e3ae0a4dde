// The work of the bias velocities that open penetration depths.
//
// A contact that is too deep must open at r = -rate > 0 (ContactRows::rate). For a single contact that takes
// at most r^2 / (2 w), with its own response w. Contacts whose normals oppose each other, as between
// interlocking teeth, can open together only at much larger velocities: for normals n and -n + e at
// r / |e|. Their impulses then do the work of that speed, however exactly they are solved. Without bias
// velocities they do none: u = 0 is always allowed, and the impulses are a projection onto the allowed set,
// which never adds energy.
#pragma once
#include "contact/rows.h"

namespace dfm {

// Whether the present impulses do more work by opening depths than single contacts would. slow: m/s, a bias
// velocity that is allowed for every contact.
bool opens_dearly(const ContactRows &rows, const RowsPart &part, double slow);

// Depths of the part no longer open, and its impulses are zero.
void stop_opening(ContactRows &rows, const RowsPart &part);

}  // namespace dfm
