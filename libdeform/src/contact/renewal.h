// How fast the area of a contact approaches its target (contact/areas.h, contact/exchange.h).
//
// Bristles are attached to the surface. If area moved with every change of load, different deflections would
// be mixed, and a rocked patch would lose its memory. Also, which of several redundant contacts is loaded
// depends on the last digits of the solve: if areas followed at once, each change would remove bristles from
// one contact and give area without bristles to another, the patch would lose force, the loads would change,
// and so on. A stack of cubes walked by micrometers per second for this reason. So areas of a patch at rest
// do not change:
//
//   a contact that carries nothing   has no bristle out, and gets its target when it begins to carry
//   one that carries                 keeps its area, except that
//     contacts of the patch let go   what the patch lacks then goes to those below target; their force is
//                                    kept, their energy falls
//     sliding renews the bristles    its area goes to its target by the share r of the way in a sub-step
//
//     r = min(1, sum fn |h v - dz| / sum fn |z|  +  min(|F - F_0| / max(F, F_0), sum fn h / (h + t) / F)),
//     sums over the patch, F = sum fn:
//
// first how far points slid on over how far their bristles are out, dz being what these took up. Sliding
// steadily that is the way over the deflection, without bristles it is 1. Then, for a patch that is being
// made, how much its load has changed since the last sub-step (F_0), as long as its contacts are young, t
// being their time in contact. One number for a patch, which is all contacts of two sides with each other, so
// that what some give is what others take.
#pragma once
#include <span>

#include "contact/contact_set.h"
#include "core/memory.h"

namespace dfm {

class Renewal {
 public:
  explicit Renewal(const Memory &memory);
  // impulse: [n,3] of the last sub-step, normal part first.
  void list(std::span<const ContactPoint> contacts, const double *impulse);
  // For the listed contacts. keeps_area: [n] 1: keeps its area; target_area: [n] m2, its area by the load;
  // area: [n] m2 in and out, for contacts with keeps_area = 1. Allocates nothing.
  void fill(const uint8_t *keeps_area, const double *target_area, double *area);
  // The slid distance of a contact and the deflection of its bristles, m.
  struct Way { double slid, out; };
  // impulse: [n,3] of this sub-step of h; ways, dwell: [n]; renewed: [n] out, r of the contact's patch.
  // Allocates nothing.
  void measure(double h, const double *impulse, const Way *ways, const double *dwell, double *renewed);

 private:
  struct Patch {
    uint64_t sides;
    double before;                  // N s, load in the last sub-step
    double load, young, slid, out;  // this one's, and sums that it weights
    // m2: of the patch's area, and what its contacts have less than they should
    double lacks, below;
  };
  Array<Patch> patches_;
  Array<uint32_t> patch_of_;  // [n]
};

}  // namespace dfm
