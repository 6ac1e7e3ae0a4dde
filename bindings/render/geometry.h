// Triangles for the GPU: surfaces with creased normals, solids, ribbons. Everything becomes one kind of
// vertex, three to a triangle, placed relative to the scene's center so that single precision suffices far
// from the origin.
#pragma once
#include <array>
#include <cmath>
#include <vector>

#include "render.h"

namespace render {

struct Vec {
  double x = 0, y = 0, z = 0;
  Vec operator+(const Vec &o) const { return {x + o.x, y + o.y, z + o.z}; }
  Vec operator-(const Vec &o) const { return {x - o.x, y - o.y, z - o.z}; }
  Vec operator*(double s) const { return {x * s, y * s, z * s}; }
};
inline Vec vec(const double p[3]) { return {p[0], p[1], p[2]}; }
inline double dot(const Vec &a, const Vec &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(const Vec &a, const Vec &b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec &a) { return std::sqrt(dot(a, a)); }
inline bool finite(const Vec &a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }
// `otherwise` where a has no direction.
Vec unit(const Vec &a, const Vec &otherwise = {0, 0, 1});
// Any direction square to the unit vector n.
Vec square_to(const Vec &n);

using Mat4 = std::array<float, 16>;  // columns, as GL reads them
struct View {
  Vec eye, right, up, back;
  double tan_half;
};
View view_of(const Camera &camera);
Mat4 perspective(const View &view, double aspect, double near, double far);
// Looks against `toward_light` at a ball of that radius around the origin; clip coordinates -1..1.
Mat4 orthographic(const Vec &toward_light, const Vec &center, double radius);
// Clip coordinates -1..1 to texture coordinates and depth 0..1.
Mat4 to_texture(const Mat4 &clip);

struct Vertex { float p[3], n[3], rgb[3], value, has_value; };

struct Shape {
  std::vector<Vertex> vertices;
  Vec origin;
  Vertex &vertex(const Vec &p, const Vec &n, const float rgb[3]);
  void quad(const Vec p[4], const Vec n[4], const float rgb[3]);  // corners in order around it
  void surface(const Surface &s);
  void box(const Vec &center, const Vec axes[3], const float rgb[3]);  // axes carry the half lengths
  void sphere(const Sphere &s);
  void capsule(const Capsule &c);
  void ribbons(const Lines &lines, const View &view, double pixels_high);

 private:
  void revolve(const Vec &a, const Vec &axis, const std::vector<std::array<double, 4>> &profile,
               const float rgb[3]);
};

void axes_of(const Box &box, Vec axes[3]);

// Cosines to the up direction from which a plane is the floor, and from which it is a ramp
// rather than a wall.
inline constexpr double kLevel = 0.9999, kRamp = 0.3;
// Never empty: Scene::extent, or bounds(), or a box of 2 m around the origin.
Bounds extent_of(const Scene &scene);
Bounds room_of(const Scene &scene, const Vec &up, const Bounds &extent);
struct Slab { Vec center, axes[3]; };
Slab slab_of(const Plane &p, const Vec &up, const Bounds &extent);

}  // namespace render
