// Contacts of bodies with few motions: more contacts than motions.
//
// With r motions (modes, a rigid body) and n contacts, W = G G^T with G [3n, r], and impulses that change no
// motion are in its null space. The motion does not determine them, but complementarity does: a loaded
// contact with a gap must transfer its load to others. A sweep moves such loads by at most u / w, the same in
// each sweep, so the transfer takes thousands of sweeps, which acceleration cannot predict, because nothing
// else changes (doc/decisions/contact_solver.md).
//
// The proximal point method takes the same way in long strides (Rockafellar 1976). With l0 the impulses so
// far, it solves the contact problem in which each contact is compliant to its change of impulse by 1/rho, in
// addition to the response of the bodies,
//     l = P(l0 - rho (u(l) + b)),       P: laws of normal contact and friction,
// and begins again from there; its fixed points are those of the sweeps. Where rho is 1000 / w a stride is
// worth about as many sweeps. Each is found by Newton's method in the r rates z of the motions alone,
//     F(z) = z - G^T l(u0 + G z),
// whose matrix I - G^T (dl/du) G is of size r and regular, with a line search on |F|.
//
// Contacts that share motions, directly or through others, form a part; parts are solved separately.
#pragma once
#include <span>

#include "contact/contact_state.h"
#include "contact/rows.h"

namespace dfm {

class Proximal {
 public:
  explicit Proximal(const Memory &memory);
  // Finds the parts of these rows. leave: [blocks of all] 1: a part with this block is left out, and so is
  // one with points that respond to their own impulses alone.
  uint32_t find_parts(const ContactRows &rows, const RowsPart &of, std::span<const uint8_t> leave);
  std::span<const uint32_t> contacts(uint32_t part) const;
  // Returns false if its bodies have too many motions.
  bool take(const ContactRows &rows, uint32_t part);
  // One stride of the part taken, from the rows' impulses, which change; rho: over each contact's own 1 /
  // response. False: no result was found, and nothing has changed.
  bool stride(ContactRows &rows, const ContactState &law, double h, double rho);
  // The part taken, as it is with these impulses [3 rows.n].
  void put(ContactRows &rows, const double *impulse) const;
  // Work of the last stride, in units of swept contacts.
  uint64_t work() const { return work_; }

 private:
  // l, and its derivative by u, [3,3] row-major
  struct Answer { double l[3], slope[9]; };
  struct Part { uint32_t root, contact, block; };  // first of its contacts, of its blocks
  Array<Part> parts_;                              // and one behind the last
  Array<uint32_t> root_;                           // [blocks] the part's lowest block
  Array<uint8_t> alone_;                           // [blocks] of a root: the part is skipped
  Array<uint32_t> contact_, block_;                // by part
  std::span<const uint32_t> contacts_, blocks_;    // of the part taken
  uint32_t n_ = 0, r_ = 0, width_ = 0;             // width: r, padded with zeros to whole fours
  uint64_t work_ = 0;
  ContactRows::Motions motions_;      // g: [3n, width]
  Array<double> from_;                // [3n] m/s without impulses
  Array<double> start_;               // [3n] l0
  Array<double> z_, try_, f_, down_;  // [width]
  Array<double> u_, l_;               // [3n]
  Array<double> slope_;               // [n,9]
  Array<double> matrix_;              // [r, width]
  uint32_t root_of(uint32_t block) const;
  bool answer(const ContactRows &rows, const ContactState &law, uint32_t k, double h, double rho,
              Answer &out) const;
  double residual(const ContactRows &rows, const ContactState &law, double h, double rho, const double *z,
                  double *f);
  bool newton();
};

}  // namespace dfm
