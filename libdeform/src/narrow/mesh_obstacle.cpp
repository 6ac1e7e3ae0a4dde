// Bodies against meshes that have no dofs: the same search as between two bodies, after which the mesh's side
// of each contact becomes the velocity that its pose gives it. Surfels keep all of their area, as against any
// obstacle; vertices of the mesh borrow theirs (Areas in narrow_phase.cpp), so a patch that touches all over
// adds up to its area once.
#include <algorithm>

#include "narrow/detail.h"

namespace dfm::narrow {
namespace {

// Found with the mesh as a, because one of its vertices meets a face of the body: the body becomes
// a, the mesh b.
void turn_over(ContactPoint &c) {
  std::swap(c.slot_a, c.slot_b);
  std::swap(c.feature_a, c.feature_b);
  store3(c.normal, -load3(c.normal));
  for (int k = 0; k < c.nnode; ++k) c.weight[k] = -c.weight[k];
  c.type_a = 2;
  c.area = 0;
}

void drop_nodes(ContactPoint &c, const BodyView &mesh) {
  uint8_t kept = 0;
  for (int k = 0; k < c.nnode; ++k) {
    if (c.node[k] - mesh.first_node < mesh.surface->nsurfel) continue;
    c.node[kept] = c.node[k];
    c.weight[kept++] = c.weight[k];
  }
  for (int k = kept; k < c.nnode; ++k) {
    c.node[k] = 0;
    c.weight[k] = 0;
  }
  c.nnode = kept;
}

}  // namespace

void mesh_obstacle(const Pair &pair, const ObstacleView &view, uint8_t kind, Run run,
                   Array<ContactPoint> &out) {
  const size_t begin = out.size();
  const BodyView &mesh = *pair.b;
  if (kind == 2)
    vertex_face({mesh, &pair.a, nullptr, pair.h, pair.offset, largest_speed(*pair.a.surface)}, run, out);
  else (kind == 0 ? vertex_face : edge_edge)(pair, run, out);
  for (size_t i = begin; i < out.size(); ++i) {
    ContactPoint &c = out[i];
    if (kind == 2) turn_over(c);
    drop_nodes(c, mesh);
    c.kind = kPrimitive;
    c.obstacle = 1;
    c.area *= 2;
    const Vec3 normal = load3(c.normal), on_body = load3(c.point) + (0.5 * c.distance) * normal;
    store3(c.velocity, view.velocity_at(on_body, pair.h) - dot(view.belt, normal) * normal);
  }
  if (kind == 2)
    std::sort(out.begin() + begin, out.end(), [](const ContactPoint &l, const ContactPoint &r) {
      return l.feature_a != r.feature_a ? l.feature_a < r.feature_a : l.feature_b < r.feature_b;
    });
}

}  // namespace dfm::narrow
