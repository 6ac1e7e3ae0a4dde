// The area of each contact, for laws that use area: the stiffness of a patch is then sigma0 times its area,
// independent of the meshes.
//
// Detection gives a surfel a third of the triangles around it (half of that between two bodies), as if all
// points of both sides touched, and mostly no area to crossings of edges. Two meshes in contact rest on some
// of these: on corners of one side, on corners of the other, on crossings between. Up to half of the patch
// would have no bristles, and half of the normal force no bristles to hold it. So, among contacts that were
// loaded in the last sub-step:
//
//   a corner on a face   its whole area, divided by 1 + how much of the other side's area is there: the
//                        weights of that face's corners that carry load
//   a crossing           takes from the corners that it lies between, in proportion to its weights on them,
//                        and a corner keeps in proportion to 1, or nothing where it touches without a load:
//                        of redundant contacts in one place some idle. Where none of the corners touches, the
//                        area of a free one
// Both change smoothly as a point slides over a mesh. An unloaded contact gets the area that it would have
// under load, and takes nothing from others.
#pragma once
#include <span>

#include "contact/contact_set.h"
#include "core/memory.h"

namespace dfm {

class AreaShares {
 public:
  explicit AreaShares(const Memory &memory);
  // impulse: [n,3], normal part first, of the last sub-step; touch: m, distance within which a corner
  // touches; area: [n] out, m2. The result depends only on these and on nodes, weights, distances and areas,
  // not on the order.
  void share(std::span<const ContactPoint> contacts, const double *impulse, double touch, double *area);

 private:
  // other: slot of the other side; the top bit is set for obstacles
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
  Array<double> taken_;  // [n] weights of contacts that take from a giver
  // [n] m2, area that a giver shares; of an unloaded one the area that no corner of the other side has
  Array<double> given_;
  Array<uint32_t> left_;
  void list_owners(std::span<const ContactPoint> contacts, const double *impulse, double touch, bool idle);
  std::span<const Owner> owners_of(uint32_t node, uint32_t other) const;
};

}  // namespace dfm
