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

// Whether some contact does more work than it may. Cheap; nearly always false.
bool opens_dearly(const ContactRows &rows, const RowsPart &part, double slow);

// J. put_in: l.r over the contacts that open, which bounds their work; allowed: what they may do.
struct OpeningWork { double put_in = 0, allowed = 0; };

// slow: m/s, a bias velocity that is allowed for every contact.
OpeningWork opening_work(const ContactRows &rows, const RowsPart &part, double slow);

// The work that the present impulses do by opening depths: the excess over impulses that allow u = 0. Zero or
// less if nothing opens.
double work_of_opening(const ContactRows &rows, const RowsPart &part, double put_in);

// Multiplies the bias velocities of the part by this share.
void slow_opening(ContactRows &rows, const RowsPart &part, double share);

}  // namespace dfm
