// Spheres, boxes, capsules and planes are the library's own, cylinders meshes of 64 sides. Every other convex
// shape is the hull of its corners, without Bullet's margin around them, or of its farthest points in
// kDirections directions where it is round. Concave shapes give their triangles.
#include "shapes.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <cmath>

namespace dfm_bullet_detail {
namespace {

constexpr int kDirections = 400;

class Collector : public btTriangleCallback {
 public:
  void processTriangle(btVector3 *corner, int, int) override {
    std::array<double, 3> c[3];
    for (int k = 0; k < 3; ++k) c[k] = {corner[k].x(), corner[k].y(), corner[k].z()};
    welder.add(c);
  }
  Welder welder;
};

// Turns triangles upward: Bullet touches both sides of them, the library the side to which they face.
void face_up(Triangles &t, int up) {
  for (size_t i = 0; i < t.corners.size(); i += 3) {
    const auto at = [&](size_t k) { return load(&t.points[size_t{3} * t.corners[i + k]]); };
    double normal[3];
    store(normal, cross(at(1) - at(0), at(2) - at(0)));
    if (normal[up] < 0) std::swap(t.corners[i + 1], t.corners[i + 2]);
  }
}

Triangles of_concave(const btConcaveShape &shape) {
  Collector collector;
  btVector3 low, high;  // of the shape: a heightfield counts in these bounds, and larger ones overflow
  shape.getAabb(btTransform::getIdentity(), low, high);
  shape.processAllTriangles(&collector, low, high);
  Triangles t = collector.welder.take();
  if (shape.getShapeType() == TERRAIN_SHAPE_PROXYTYPE)
    face_up(t, static_cast<const btHeightfieldTerrainShape &>(shape).getUpAxis());
  return t;
}

// Directions spread evenly (Fibonacci's lattice on the sphere).
std::vector<btVector3> corners_of(const btConvexShape &shape) {
  std::vector<btVector3> out;
  if (shape.isPolyhedral()) {
    const auto &p = static_cast<const btPolyhedralConvexShape &>(shape);
    out.resize(static_cast<size_t>(p.getNumVertices()));
    for (int i = 0; i < p.getNumVertices(); ++i) p.getVertex(i, out[static_cast<size_t>(i)]);
    return out;
  }
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - z * z), a = 2.399963229728653 * i;
    const btVector3 direction = to_bullet(Vec{r * std::cos(a), r * std::sin(a), z});
    // of a cone the margin is no part of its sizes
    out.push_back(shape.getShapeType() == CONE_SHAPE_PROXYTYPE
                      ? shape.localGetSupportingVertexWithoutMargin(direction)
                      : shape.localGetSupportingVertex(direction));
  }
  return out;
}

Triangles of_convex(const btConvexShape &shape) {
  const std::vector<btVector3> corners = corners_of(shape);
  btConvexHullComputer hull;
  Triangles t;
  if (corners.size() < 4) return t;
  hull.compute(&corners[0].m_floats[0], sizeof(btVector3), static_cast<int>(corners.size()), 0, 0);
  for (int i = 0; i < hull.vertices.size(); ++i) {
    const Vec p = from_bullet(hull.vertices[i]);
    t.points.insert(t.points.end(), {p.x, p.y, p.z});
  }
  for (int f = 0; f < hull.faces.size(); ++f) {  // a fan from each face's first corner
    const btConvexHullComputer::Edge *const first = &hull.edges[hull.faces[f]];
    const uint32_t at = static_cast<uint32_t>(first->getSourceVertex());
    const btConvexHullComputer::Edge *e = first->getNextEdgeOfFace();
    for (; static_cast<uint32_t>(e->getTargetVertex()) != at; e = e->getNextEdgeOfFace())
      t.corners.insert(t.corners.end(), {at, static_cast<uint32_t>(e->getSourceVertex()),
                                         static_cast<uint32_t>(e->getTargetVertex())});
  }
  return t;
}

// Turns z to the axis along which the shape lies.
Quat along(int axis) {
  const double h = std::sqrt(0.5);
  return axis == 0 ? Quat{0, h, 0, h} : axis == 1 ? Quat{-h, 0, 0, h} : Quat{};
}

Vec size_of(const btCollisionShape *s, int type) {
  switch (type) {
    case BOX_SHAPE_PROXYTYPE:
      return from_bullet(static_cast<const btBoxShape *>(s)->getHalfExtentsWithMargin());
    case SPHERE_SHAPE_PROXYTYPE: return {static_cast<const btSphereShape *>(s)->getRadius(), 0, 0};
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto &c = *static_cast<const btCapsuleShape *>(s);
      return {c.getRadius(), c.getHalfHeight(), double(c.getUpAxis())};
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      const auto &c = *static_cast<const btCylinderShape *>(s);
      return {c.getRadius(), double(c.getHalfExtentsWithMargin()[c.getUpAxis()]), double(c.getUpAxis())};
    }
    case STATIC_PLANE_PROXYTYPE:
      return from_bullet(static_cast<const btStaticPlaneShape *>(s)->getPlaneNormal());
    default: return {};
  }
}

void sizes(Part &p) {
  const Vec size = size_of(p.shape, p.type);
  if (p.type == STATIC_PLANE_PROXYTYPE)
    p.local =
        p.local * plane_pose(size, static_cast<const btStaticPlaneShape *>(p.shape)->getPlaneConstant());
  if (p.type == CONVEX_HULL_SHAPE_PROXYTYPE)
    p.revision = static_cast<const btConvexHullShape *>(p.shape)->getNumPoints();
  store(p.size, size);
  store(p.scaling, from_bullet(p.shape->getLocalScaling()));
}

bool same(const Pose &a, const Pose &b) {
  const Vec p = a.position - b.position;
  const Quat q = a.rotation, r = b.rotation;
  return dot(p, p) == 0 && q.x == r.x && q.y == r.y && q.z == r.z && q.w == r.w;
}

}  // namespace

bool Part::operator==(const Part &o) const {
  return shape == o.shape && type == o.type && revision == o.revision && std::equal(size, size + 3, o.size) &&
         std::equal(scaling, scaling + 3, o.scaling) && same(local, o.local);
}

bool is_still(const btCollisionShape *shape, const std::vector<Part> &parts) {
  if (parts.size() != 1 || parts[0].shape != shape || parts[0].type != shape->getShapeType() ||
      !same(parts[0].local, {}))
    return false;
  const double *const size = parts[0].size;
  switch (parts[0].type) {  // sizes include the scaling
    case BOX_SHAPE_PROXYTYPE: {
      const btVector3 now = static_cast<const btBoxShape *>(shape)->getHalfExtentsWithMargin();
      return size[0] == now.x() && size[1] == now.y() && size[2] == now.z();
    }
    case SPHERE_SHAPE_PROXYTYPE: return size[0] == static_cast<const btSphereShape *>(shape)->getRadius();
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto &now = *static_cast<const btCapsuleShape *>(shape);
      return size[0] == now.getRadius() && size[1] == now.getHalfHeight() && size[2] == now.getUpAxis();
    }
    default: return false;
  }
}

bool parts_of(const btCollisionShape *shape, const Pose &local, std::vector<Part> &out,
              const btCollisionShape *&unknown) {
  if (shape->isCompound()) {
    const auto &compound = *static_cast<const btCompoundShape *>(shape);
    for (int i = 0; i < compound.getNumChildShapes(); ++i)
      if (!parts_of(compound.getChildShape(i), local * from_bullet(compound.getChildTransform(i)), out,
                    unknown))
        return false;
    return true;
  }
  if (shape->getShapeType() == EMPTY_SHAPE_PROXYTYPE) return true;
  if (!shape->isConvex() && !shape->isConcave()) {
    unknown = shape;
    return false;
  }
  Part &p = out.emplace_back();
  p.shape = shape;
  p.type = shape->getShapeType();
  p.local = local;
  sizes(p);
  return true;
}

void describe(const Part &part, dfm_obstacle_def &def, Pose &local, Triangles &made) {
  local = part.local;
  switch (part.type) {
    case SPHERE_SHAPE_PROXYTYPE:
      def.shape = DFM_SHAPE_SPHERE;
      def.radius = part.size[0];
      break;
    case BOX_SHAPE_PROXYTYPE:
      def.shape = DFM_SHAPE_BOX;
      std::copy(part.size, part.size + 3, def.half_size);
      break;
    case CAPSULE_SHAPE_PROXYTYPE:
      def.shape = DFM_SHAPE_CAPSULE;
      def.radius = part.size[0];
      def.half_length = part.size[1];
      local.rotation = unit(local.rotation * along(static_cast<int>(part.size[2])));
      break;
    case STATIC_PLANE_PROXYTYPE: def.shape = DFM_SHAPE_PLANE; break;
    default:
      if (part.type == CYLINDER_SHAPE_PROXYTYPE)
        made = cylinder(part.size[0], 2 * part.size[1], static_cast<int>(part.size[2]));
      else if (part.shape->isConcave()) made = of_concave(*static_cast<const btConcaveShape *>(part.shape));
      else made = of_convex(*static_cast<const btConvexShape *>(part.shape));
      made.fill(def);
      break;
  }
}

}  // namespace dfm_bullet_detail
