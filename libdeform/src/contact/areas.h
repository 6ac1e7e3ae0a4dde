// How much of a patch each contact stands for, where a law counts by area: its stiffness then is sigma0 times
// the area of the patch, whatever the meshes.
//
// Detection gives a surfel the third of the triangles around it, half of it between two bodies, as if all
// points of both sides touched, and crossings of edges mostly nothing. Two meshes that lie on each other rest
// on some of these: on the corners of one side here, on those of the other there, on crossings in between,
// and up to half of the patch would have no bristles, and half of the normal force none to hold. So, among
// contacts that carried load in the last sub-step:
//
//   a corner on a face   its whole area, divided by 1 + how much of the other side's area is there: the
//                        weights of that face's corners that carry load
//   a crossing           takes from the corners that it lies between, in proportion to its weights on them,
//                        and a corner keeps in proportion to 1, or nothing where it touches without a load:
//                        of redundant contacts in one place some idle. Where none of the corners touches, the
//                        area of a free one
// Both change smoothly as a point slides over a mesh. A contact that carried nothing gets what it would have
// if it did; it takes nothing from others.
#pragma once
#include <span>

#include "contact/contact_set.h"
#include "core/memory.h"

namespace dfm {

class AreaShares {
 public:
  explicit AreaShares(const Memory &memory);
  // impulse: [n,3], normal part first, of the last sub-step; touch: m, distance within which a corner
  // touches; area: [n] out, m2. A function of these and of nodes, weights, distances and areas, in any order.
  void share(std::span<const ContactPoint> contacts, const double *impulse, double touch, double *area);

 private:
  // other: slot of the other side, obstacles' with the top bit set
  struct Owner {
    uint32_t node, other, contact;
    bool loaded;
  };
  struct Part {
    uint32_t taker, giver;
    double weight;
  };
  Array<Owner> owners_;
  Array<Part> parts_;
  Array<double> taken_;  // [n] weights that draw on a giver
  // [n] m2, what a giver shares: of one that idles, what no corner of the other side stands for
  Array<double> given_;
  Array<uint32_t> left_;
  void list_owners(std::span<const ContactPoint> contacts, const double *impulse, double touch, bool idle);
  std::span<const Owner> owners_of(uint32_t node, uint32_t other) const;
};

}  // namespace dfm
