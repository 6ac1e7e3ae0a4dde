// Gives uniform pressure under uniform load: the areas of neighboring contacts follow the shares of the
// normal force that the mesh gives them.
//
// Detection gives a corner a third of the triangles around it. The share of a uniform pressure that a corner
// bears differs: it depends on how the body's model distributes force to its points (springs, lumped masses),
// and on a pad of regular cells the pressures fn/A of neighbors differ by a factor of two, however fine the
// mesh is. Rigid-plastic friction is not affected. A bristle is, since its force K A z is bounded by mu fn:
// corners with little force slip early, those with much force lag behind, and the patch breaks loose below
// its limit.
//
// So each triangle of the patch, of area w, exchanges area between its corners in proportion to their normal
// forces. With p_i = fn_i / A_i,
//
//     A_i* = A_i + sum over triangles T, their other corners j of
//            w (p_i - p_j) / (3 sum_T p) min(1, 2 min(p_i, p_j) / max(p_i, p_j))                  (1)
//
// Without the last factor that is A_i* = sum_T w p_i / sum_T p, or 1/p_i* = mean over the fan of 1/mean_T p:
// the pressure averaged over a ring of triangles. What passes is antisymmetric, so that the patch keeps its
// area; evens out within a ring what alternates from corner to corner; and cancels where the pressure changes
// linearly, so that a pressure that falls toward a rim stays one. The last factor makes it continuous where a
// corner begins to carry.
//
// Areas go there as fast as sliding renews the bristles: contact/renewal.h.
#pragma once
#include <span>

#include "contact/contact_set.h"
#include "contact/rows.h"
#include "core/memory.h"

namespace dfm {

class AreaExchange {
 public:
  explicit AreaExchange(const Memory &memory);
  // Lists the contacts that exchange area. sources: by body slot. law: [n], contacts of the same law exchange
  // area; kNone: none. area: [n] m2, as detection and AreaShares (contact/areas.h) have it.
  void list(std::span<const ContactPoint> contacts, std::span<const DofSource> sources, const uint32_t *law,
            const double *area);
  void clear() {
    triangles_.clear();
    last_.clear();
    corners_.clear();
  }
  // contacts, sources: as listed; surfaces still where contacts were found. area: [n] m2, as listed; becomes
  // A* for the contacts that take part. impulse: [n,3], normal part first. Allocates nothing.
  void pass(std::span<const ContactPoint> contacts, std::span<const DofSource> sources, const double *impulse,
            double *area);

 private:
  struct Corner { uint32_t node, other, contact, law; };
  // A triangle of the surface in slot_a of its contacts, and the share of each corner in it. kNone: takes no
  // part.
  struct Triangle {
    uint32_t slot, number, contact[3];
    double area[3];
  };
  // those that take part, by node; all, as they were when the triangles were listed
  Array<Corner> corners_, last_;
  Array<Corner> fresh_;
  Array<Triangle> triangles_;
  // [n] as listed; share of its triangles that a contact represents; fn/A
  Array<double> area_, part_, pressure_;
  const Corner *find(uint32_t node, uint32_t other) const;
  void measure(std::span<const ContactPoint> contacts, std::span<const DofSource> sources);
  void list_triangles(std::span<const ContactPoint> contacts, std::span<const DofSource> sources);
};

}  // namespace dfm
