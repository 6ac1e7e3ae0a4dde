// Contacts that live: what one contact keeps from step to step, found again by its key. Warm start, bristle state, events and the hold
// measure hang on it.
#pragma once
#include <span>

#include "contact/rows.h"
#include "surfel/contact_state.h"

namespace dfm {

struct ContactStore {
  // Columns over the contacts of the last sub-step, in their order.
  uint32_t n = 0, nstate = 0;
  double h = 0;                       // s, the sub-step that the impulses belong to
  Array<uint64_t> key;
  Array<uint64_t> id_a, id_b;         // ids of the pair (obstacles have ids of the same sequence)
  Array<uint32_t> by_key;             // indices in ascending key order
  Array<double> normal, tangent;      // [n,3]
  Array<double> impulse;              // [n,3] in the frame
  Array<double> bristle;              // [n,nstate] row-major
  Array<uint32_t> law;                // the law the bristles belong to
  Array<double> dwell, area;          // s in contact, m2
  Array<double> due;                  // m2, area in the next sub-step (contact/renewal.h); empty where no law counts by area
  Array<double> path;                 // [n,2] m, net slip since hold_begin, in the frame
  Array<uint8_t> touching, held;      // held: touched and stuck in every sub-step since hold_begin
  Array<uint8_t> began;               // touched for the first time in the last step
  Array<Crossing> crossings;          // edges that touch each other, ascending

  explicit ContactStore(const Memory &memory);
  uint32_t find(uint64_t key) const;  // index, or kNone
};

// Fresh contacts take over what their predecessors kept: the tangent turned with the normal (minimal rotation), impulse times h/h_old,
// bristles where the law is the same. `tangents` [n,3] out; rows.impulse and state.bristle are filled. match [n] out: index or kNone.
void warm_start(const ContactStore &old, std::span<const ContactPoint> contacts, double h, ContactRows &rows, ContactState &state,
                double *tangents, uint32_t *match);

// The tangent t of normal m turned to normal n by the smallest rotation; a fresh tangent where the normals are more than 120 degrees apart.
Vec3 transport(Vec3 t, Vec3 m, Vec3 n, bool *reset);

}  // namespace dfm
