// Work of the velocities at which depths are opened.
//
// A contact that is too deep must open at r = -rate > 0 (ContactRows::rate). For one contact that costs at
// most r^2 / (2 w), w its own response. Contacts whose normals oppose each other, as of teeth that interlock,
// can open together only at velocities that are much larger: for normals n and -n + e at r / |e|. Their
// impulses then do the work of any speed, however exactly they are found. Without an opening velocity none
// can: u = 0 is always allowed, and the impulses are a projection onto what is allowed, which never adds
// energy.
#pragma once
#include "contact/rows.h"

namespace dfm {

// False: no contact puts in more than it may. Cheap, and nearly always the answer.
bool opens_dearly(const ContactRows &rows, const RowsPart &part, double slow);

// J. put_in: l.r over the contacts that open, which bounds their work; allowed: what they may do.
struct OpeningWork { double put_in = 0, allowed = 0; };

// slow: m/s, as fast as this a contact may open at least, for the count of what is allowed.
OpeningWork opening_work(const ContactRows &rows, const RowsPart &part, double slow);

// The work that the present impulses have done by opening depths: what they do more than impulses that allow
// u = 0 could. Zero or less where nothing opens.
double work_of_opening(const ContactRows &rows, const RowsPart &part, double put_in);

// Opens the depths of the part at this share of their velocities.
void slow_opening(ContactRows &rows, const RowsPart &part, double share);

}  // namespace dfm
