// Spheres, boxes, capsules and planes are the library's own, cylinders meshes. Trimeshes are read once,
// triangle by triangle, when they come in; ODE has no getter for the arrays of convexes and heightfields.
#include "shapes.h"

#include <algorithm>

namespace dfm_ode_detail {
namespace {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
dGeomID inner_of(dGeomID transform) { return dGeomTransformGetGeom(transform); }
#pragma GCC diagnostic pop

dGeomID shape_of(dGeomID geom) { return dGeomGetClass(geom) == dGeomTransformClass ? inner_of(geom) : geom; }

Pose ode_pose(const dReal *position, const dReal *quaternion) {
  return {load(position), from_ode(quaternion)};
}
Pose ode_pose(dGeomID geom) {
  dQuaternion q;
  dGeomGetQuaternion(geom, q);
  return ode_pose(dGeomGetPosition(geom), q);
}

void sizes(dGeomID g, Signature &s) {
  switch (dGeomGetClass(g)) {
    case dSphereClass: s.size[0] = dGeomSphereGetRadius(g); break;
    case dBoxClass: {
      dVector3 l;
      dGeomBoxGetLengths(g, l);
      std::copy(l, l + 3, s.size);
      break;
    }
    case dCapsuleClass: dGeomCapsuleGetParams(g, &s.size[0], &s.size[1]); break;
    case dCylinderClass: dGeomCylinderGetParams(g, &s.size[0], &s.size[1]); break;
    case dTriMeshClass:
      s.mesh = dGeomTriMeshGetData(g);
      s.triangles = dGeomTriMeshGetTriangleCount(g);
      break;
    default: break;
  }
}

// ODE moves every corner by the same operations, so corners at one place are equal to the bit.
Triangles read_trimesh(dGeomID g) {
  Welder welder;
  const Pose back = inverse(ode_pose(g));
  const int n = dGeomTriMeshGetTriangleCount(g);
  for (int i = 0; i < n; ++i) {
    dVector3 v[3];
    dGeomTriMeshGetTriangle(g, i, &v[0], &v[1], &v[2]);
    std::array<double, 3> corner[3];
    for (int k = 0; k < 3; ++k) {
      const Vec p = back.position + rotate(back.rotation, load(v[k]));
      corner[k] = {p.x, p.y, p.z};
    }
    welder.add(corner);
  }
  return welder.take();
}

}  // namespace

bool Signature::operator==(const Signature &o) const {
  const Vec p = local.position - o.local.position;
  const Quat q = local.rotation, r = o.local.rotation;
  return geom_class == o.geom_class && inner_class == o.inner_class && std::equal(size, size + 3, o.size) &&
         mesh == o.mesh && triangles == o.triangles && enabled == o.enabled && body == o.body &&
         dot(p, p) == 0 && q.x == r.x && q.y == r.y && q.z == r.z && q.w == r.w;
}

Signature signature_of(dGeomID geom) {
  Signature s;
  s.geom_class = dGeomGetClass(geom);
  const dGeomID shape = shape_of(geom);
  s.inner_class = shape ? dGeomGetClass(shape) : -1;
  if (shape) sizes(shape, s);
  s.category = static_cast<uint32_t>(dGeomGetCategoryBits(geom));
  s.collides = static_cast<uint32_t>(dGeomGetCollideBits(geom));
  s.enabled = dGeomIsEnabled(geom);
  s.body = dGeomGetBody(geom);
  if (s.body) {
    if (dGeomIsOffset(geom)) {
      dQuaternion q;
      dGeomGetOffsetQuaternion(geom, q);
      s.local = ode_pose(dGeomGetOffsetPosition(geom), q);
    }
    if (shape && shape != geom) s.local = s.local * ode_pose(shape);
  }
  return s;
}

Pose pose_of(dGeomID geom) {
  const dGeomID shape = shape_of(geom);
  if (dGeomGetClass(shape) == dPlaneClass) {
    dVector4 p;
    dGeomPlaneGetParams(shape, p);
    return plane_pose(load(p), p[3]);
  }
  return shape == geom ? ode_pose(geom) : ode_pose(geom) * ode_pose(shape);
}

Part part_of(const Signature &s) {
  if (!s.enabled) return Part::none;
  switch (s.inner_class) {
    case dSphereClass:
    case dBoxClass:
    case dCapsuleClass:
    case dCylinderClass:
    case dPlaneClass:
    case dTriMeshClass: return Part::shape;
    case dConvexClass:
    case dHeightfieldClass: return Part::needs_arrays;
    case dRayClass:
    case -1: return Part::none;  // -1: a transform without a geom
    default: return Part::unknown;
  }
}

const char *class_name(int c) {
  switch (c) {
    case dConvexClass: return "convex";
    case dHeightfieldClass: return "heightfield";
    default: return "user-defined geom";
  }
}

void describe(dGeomID geom, const Signature &s, const Triangles *own, dfm_obstacle_def &def,
              Triangles &made) {
  switch (s.inner_class) {
    case dSphereClass:
      def.shape = DFM_SHAPE_SPHERE;
      def.radius = s.size[0];
      break;
    case dBoxClass:
      def.shape = DFM_SHAPE_BOX;
      for (int k = 0; k < 3; ++k) def.half_size[k] = 0.5 * s.size[k];
      break;
    case dCapsuleClass:
      def.shape = DFM_SHAPE_CAPSULE;
      def.radius = s.size[0];
      def.half_length = 0.5 * s.size[1];
      break;
    case dPlaneClass: def.shape = DFM_SHAPE_PLANE; break;
    case dCylinderClass:
      made = cylinder(s.size[0], s.size[1], 2);
      made.fill(def);
      break;
    case dTriMeshClass:
      made = read_trimesh(shape_of(geom));
      made.fill(def);
      break;
    default: own->fill(def); break;
  }
}

Triangles convex_triangles(uint32_t npoint, const double *points, uint32_t npolygon, const uint32_t *polygons,
                           std::string &wrong) {
  Triangles t;
  t.points.assign(points, points + size_t{3} * npoint);
  for (uint32_t f = 0; f < npolygon; ++f) {
    const uint32_t n = *polygons++;
    if (n < 3) wrong = "polygon " + std::to_string(f) + " has " + std::to_string(n) + " corners";
    for (uint32_t k = 0; k < n && wrong.empty(); ++k)
      if (polygons[k] >= npoint)
        wrong = "polygon " + std::to_string(f) + " names point " + std::to_string(polygons[k]) + " of " +
                std::to_string(npoint);
    if (!wrong.empty()) break;
    for (uint32_t k = 2; k < n; ++k)
      t.corners.insert(t.corners.end(), {polygons[0], polygons[k - 1], polygons[k]});
    polygons += n;
  }
  return t;
}

Triangles height_triangles(double width, double depth, uint32_t nx, uint32_t nz, const double *heights) {
  return grid(nx, nz, [&](uint32_t x, uint32_t z) {  // up is local y
    return Vec{width * (double(x) / (nx - 1) - 0.5), heights[size_t{z} * nx + x],
               depth * (double(z) / (nz - 1) - 0.5)};
  });
}

}  // namespace dfm_ode_detail
