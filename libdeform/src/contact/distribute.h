// Contact impulses to surfels to phyxels: f_s = sum_k w_k p at the contact's nodes, f_p = N^T f_s. Force,
// torque and power equal those of the contacts to rounding, because this is the transpose of how the contacts
// read velocities.
#pragma once
#include <span>

#include "contact/bond.h"
#include "contact/contact_set.h"
#include "core/memory.h"
#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

struct ImpulseSink {
  uint32_t first_node, nnode, npoint;
  const Surface *surface;
  double *surfel;  // [nsurfel,3] N s
  // [npoint,4] N s, written for points with surfels, zero elsewhere from the start; null for self-stepping
  // bodies, which use surfel impulses
  double *phyxel;
};

// The nodes that the last call gave impulses to, if nothing else has changed the sinks' values since: contact
// reaches few of them. Not known: all are zeroed.
struct WrittenNodes {
  bool known = false;
  Array<uint32_t> list;
};

void distribute(std::span<const ContactPoint> contacts, const double *frame, const double *impulse,
                std::span<const ImpulseSink> sinks, WrittenNodes &given, std::span<const Bond> bonds = {},
                const double *bond_impulse = nullptr);

// f_p = N^T f_s of a coupled surface: surfel [nsurfel,3], phyxel [npoint,4] is overwritten. A surfel without
// impulse costs one test.
void scatter_surface(const Surface &surface, const double *surfel, uint32_t npoint, double *phyxel);

}  // namespace dfm
