#include "geometry.h"

#include <algorithm>
#include <numbers>

namespace render {
namespace {

// 40 degrees: a cylinder's rim stays sharp, its side with ten or more facets looks round
constexpr double kCreaseCosine = 0.766;

struct Faces {
  std::vector<Vec> normal;          // unit; zero for a triangle that is not drawn
  std::vector<uint32_t> first, of;  // corners around vertex v: of[first[v]..first[v+1])
};

Faces faces_of(const Surface &s) {
  Faces f;
  f.normal.resize(s.ntri);
  f.first.assign(s.n + 1, 0);
  for (uint32_t t = 0; t < s.ntri; ++t) {
    const uint32_t *v = s.tri + 3 * size_t(t);
    const Vec a = vec(s.xyz + 3 * size_t(v[0]));
    const Vec b = vec(s.xyz + 3 * size_t(v[1]));
    const Vec c = vec(s.xyz + 3 * size_t(v[2]));
    const Vec n = cross(b - a, c - a);
    const double length = norm(n);
    if (!(length > 0) || !std::isfinite(length)) continue;
    f.normal[t] = n * (1 / length);
    for (int k = 0; k < 3; ++k) ++f.first[v[k] + 1];
  }
  for (uint32_t v = 0; v < s.n; ++v) f.first[v + 1] += f.first[v];
  f.of.resize(f.first[s.n]);
  std::vector<uint32_t> at(f.first.begin(), f.first.end() - 1);
  for (uint32_t t = 0; t < s.ntri; ++t)
    if (dot(f.normal[t], f.normal[t]) > 0)
      for (int k = 0; k < 3; ++k) f.of[at[s.tri[3 * size_t(t) + k]]++] = 3 * t + k;
  return f;
}

// Angle-weighted mean of the neighbors' normals across edges that are flat enough.
Vec corner_normal(const Surface &s, const Faces &f, uint32_t t, uint32_t v) {
  Vec sum;
  for (uint32_t i = f.first[v]; i < f.first[v + 1]; ++i) {
    const uint32_t other = f.of[i] / 3, k = f.of[i] % 3;
    if (dot(f.normal[other], f.normal[t]) < kCreaseCosine) continue;
    const uint32_t *w = s.tri + 3 * size_t(other);
    const Vec p = vec(s.xyz + 3 * size_t(v));
    const Vec a = unit(vec(s.xyz + 3 * size_t(w[(k + 1) % 3])) - p);
    const Vec b = unit(vec(s.xyz + 3 * size_t(w[(k + 2) % 3])) - p);
    sum = sum + f.normal[other] * std::acos(std::clamp(dot(a, b), -1.0, 1.0));
  }
  return unit(sum, f.normal[t]);
}

Mat4 from_rows(const double (&row)[4][4]) {
  Mat4 m;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) m[size_t(4 * c + r)] = float(row[r][c]);
  return m;
}

void put(float out[3], const Vec &v) {
  out[0] = float(v.x);
  out[1] = float(v.y);
  out[2] = float(v.z);
}

}  // namespace

Vec unit(const Vec &a, const Vec &otherwise) {
  const double n = norm(a);
  return n > 0 && std::isfinite(n) ? a * (1 / n) : otherwise;
}

Vec square_to(const Vec &n) { return unit(cross(n, std::abs(n.x) < 0.7 ? Vec{1, 0, 0} : Vec{0, 1, 0})); }

View view_of(const Camera &camera) {
  View v;
  v.eye = vec(camera.eye);
  v.back = unit(v.eye - vec(camera.look_at), {0, -1, 0});
  const Vec right = cross(vec(camera.up), v.back);
  v.right = norm(right) > 1e-9 ? unit(right) : square_to(v.back);
  v.up = cross(v.back, v.right);
  v.tan_half = std::tan(std::clamp(camera.fov_deg, 1.0, 170.0) * std::numbers::pi / 360);
  return v;
}

Mat4 perspective(const View &v, double aspect, double near, double far) {
  const double sy = 1 / v.tan_half;
  const double sx = sy / aspect;
  const double a = (far + near) / (near - far);
  const double b = 2 * far * near / (near - far);
  const double tx = -dot(v.right, v.eye), ty = -dot(v.up, v.eye), tz = -dot(v.back, v.eye);
  return from_rows({{sx * v.right.x, sx * v.right.y, sx * v.right.z, sx * tx},
                    {sy * v.up.x, sy * v.up.y, sy * v.up.z, sy * ty},
                    {a * v.back.x, a * v.back.y, a * v.back.z, a * tz + b},
                    {-v.back.x, -v.back.y, -v.back.z, -tz}});
}

Mat4 orthographic(const Vec &toward_light, const Vec &center, double radius) {
  const Vec z = unit(toward_light), x = square_to(z), y = cross(z, x);
  const double s = 1 / radius;
  return from_rows({{s * x.x, s * x.y, s * x.z, -s * dot(x, center)},
                    {s * y.x, s * y.y, s * y.z, -s * dot(y, center)},
                    {-s * z.x, -s * z.y, -s * z.z, s * dot(z, center)},
                    {0, 0, 0, 1}});
}

Mat4 to_texture(const Mat4 &clip) {
  Mat4 m = clip;
  for (size_t c = 0; c < 4; ++c)
    for (size_t r = 0; r < 3; ++r) m[4 * c + r] = 0.5f * clip[4 * c + r] + 0.5f * clip[4 * c + 3];
  return m;
}

void Bounds::add(const double p[3]) {
  if (!finite(vec(p))) return;
  for (int k = 0; k < 3; ++k) {
    lo[k] = std::min(lo[k], p[k]);
    hi[k] = std::max(hi[k], p[k]);
  }
}

void axes_of(const Box &box, Vec axes[3]) {
  const double *q = box.pose.rotation;
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double s = n > 0 ? 1 / n : 0, x = q[0] * s, y = q[1] * s, z = q[2] * s, w = n > 0 ? q[3] * s : 1;
  axes[0] = Vec{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)} * box.half[0];
  axes[1] = Vec{2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)} * box.half[1];
  axes[2] = Vec{2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)} * box.half[2];
}

Vertex &Shape::vertex(const Vec &p, const Vec &n, const float rgb[3]) {
  Vertex &v = vertices.emplace_back();
  put(v.p, p - origin);
  put(v.n, n);
  std::copy_n(rgb, 3, v.rgb);
  return v;
}

void Shape::quad(const Vec p[4], const Vec n[4], const float rgb[3]) {
  for (const int k : {0, 1, 2, 0, 2, 3}) vertex(p[k], n[k], rgb);
}

void Shape::surface(const Surface &s) {
  const Faces f = faces_of(s);
  vertices.reserve(vertices.size() + 3 * size_t(s.ntri));
  for (uint32_t t = 0; t < s.ntri; ++t) {
    if (!(dot(f.normal[t], f.normal[t]) > 0)) continue;
    for (int k = 0; k < 3; ++k) {
      const uint32_t i = s.tri[3 * size_t(t) + k];
      Vertex &v = vertex(vec(s.xyz + 3 * size_t(i)), corner_normal(s, f, t, i), s.rgb);
      if (s.scalar && !std::isnan(s.scalar[i])) {
        v.value = std::clamp(s.scalar[i], 0.f, 1.f);
        v.has_value = 1;
      }
    }
  }
}

void Shape::box(const Vec &center, const Vec axes[3], const float rgb[3]) {
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1.0, 1.0}) {
      const Vec n = unit(axes[k] * side), c = center + axes[k] * side;
      const Vec u = axes[(k + 1) % 3] * side, w = axes[(k + 2) % 3];  // `side` keeps the winding outward
      const Vec corner[4] = {c - u - w, c + u - w, c + u + w, c - u + w};
      const Vec normals[4] = {n, n, n, n};
      quad(corner, normals, rgb);
    }
}

// Profile points {radius, height along the axis, normal outward, normal along the axis} turned about the
// axis through a.
void Shape::revolve(const Vec &a, const Vec &axis, const std::vector<std::array<double, 4>> &profile,
                    const float rgb[3]) {
  constexpr int kSides = 48;
  const Vec u = square_to(axis), w = cross(axis, u);
  const auto ring = [&](int i) {
    const double angle = 2 * std::numbers::pi * (i % kSides) / kSides;
    return u * std::cos(angle) + w * std::sin(angle);
  };
  for (size_t j = 0; j + 1 < profile.size(); ++j)
    for (int i = 0; i < kSides; ++i) {
      const Vec d[2] = {ring(i), ring(i + 1)};
      Vec p[4], n[4];
      for (int k = 0; k < 4; ++k) {
        const auto &q = profile[j + size_t(k / 2)];
        const Vec &out = d[k == 1 || k == 2];
        p[k] = a + out * q[0] + axis * q[1];
        n[k] = out * q[2] + axis * q[3];
      }
      quad(p, n, rgb);
    }
}

void Shape::capsule(const Capsule &c) {
  const Vec a = vec(c.a), b = vec(c.b), axis = unit(b - a);
  const double length = norm(b - a);
  std::vector<std::array<double, 4>> profile;
  constexpr int kRings = 24;  // an even number, so that the equator belongs to both caps
  for (int i = 0; i <= kRings; ++i) {
    const double angle = std::numbers::pi * (double(i) / kRings - 0.5);
    const double out = std::cos(angle);
    const double along = std::sin(angle);
    if (2 * i <= kRings) profile.push_back({c.radius * out, c.radius * along, out, along});
    if (2 * i >= kRings) profile.push_back({c.radius * out, length + c.radius * along, out, along});
  }
  revolve(a, axis, profile, c.look.rgb);
}

void Shape::sphere(const Sphere &s) {
  Capsule c{
      {s.center[0], s.center[1], s.center[2]}, {s.center[0], s.center[1], s.center[2]}, s.radius, s.look};
  capsule(c);
}

void Shape::ribbons(const Lines &lines, const View &view, double pixels_high) {
  for (uint32_t i = 0; i < lines.n; ++i) {
    const Vec end[2] = {vec(lines.xyz + 6 * size_t(i)), vec(lines.xyz + 6 * size_t(i) + 3)};
    if (!finite(end[0]) || !finite(end[1])) continue;
    const Vec side = unit(cross(end[1] - end[0], view.eye - end[0]), view.right);
    Vec p[4];
    for (int k = 0; k < 2; ++k) {
      const double depth = dot(view.eye - end[k], view.back);
      const Vec half = side * (0.5 * lines.width * 2 * view.tan_half * depth / pixels_high);
      p[k ? 3 : 0] = end[k] - half;
      p[k ? 2 : 1] = end[k] + half;
    }
    const Vec n[4] = {view.back, view.back, view.back, view.back};
    quad(p, n, lines.rgb);
  }
}

Bounds bounds(const Scene &scene) {
  Bounds bodies;
  for (const Surface &s : scene.surfaces)
    for (uint32_t i = 0; i < s.n; ++i) bodies.add(s.xyz + 3 * size_t(i));
  Bounds limit;  // how far solids count: a table of 10 m under a ball of 0.1 m must not make the ball a dot
  if (!bodies.empty()) {
    const double reach = norm(vec(bodies.hi) - vec(bodies.lo));
    for (int k = 0; k < 3; ++k) {
      limit.lo[k] = bodies.lo[k] - 0.5 * reach;
      limit.hi[k] = bodies.hi[k] + 0.5 * reach;
    }
  }
  Bounds all = bodies;
  const auto add = [&](const Vec &center, const Vec &half) {
    const Vec low = center - half, high = center + half;
    double lo[3] = {low.x, low.y, low.z}, hi[3] = {high.x, high.y, high.z};
    if (!limit.empty())
      for (int k = 0; k < 3; ++k) {
        lo[k] = std::clamp(lo[k], limit.lo[k], limit.hi[k]);
        hi[k] = std::clamp(hi[k], limit.lo[k], limit.hi[k]);
      }
    all.add(lo);
    all.add(hi);
  };
  for (const Box &b : scene.boxes) {
    Vec a[3];
    axes_of(b, a);
    Vec half;
    for (const Vec &axis : a) half = half + Vec{std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)};
    add(vec(b.pose.position), half);
  }
  for (const Sphere &s : scene.spheres) add(vec(s.center), {s.radius, s.radius, s.radius});
  for (const Capsule &c : scene.capsules)
    for (const double *end : {c.a, c.b}) add(vec(end), {c.radius, c.radius, c.radius});
  return all;
}

Camera auto_camera(const Bounds &given, double aspect, const double up_in[3]) {
  const Vec up = unit(vec(up_in)), across = square_to(up), ahead = cross(up, across);
  const Vec lo = given.empty() ? Vec{-1, -1, -1} : vec(given.lo);
  const Vec hi = given.empty() ? Vec{1, 1, 1} : vec(given.hi);
  const double azimuth = -0.95, elevation = 0.36;  // radians: from the front right, a little above
  const Vec away = (across * std::sin(azimuth) + ahead * std::cos(azimuth)) * std::cos(elevation) +
                   up * std::sin(elevation);
  const Vec center = (lo + hi) * 0.5;
  Camera camera;
  const Vec toward = center + away;
  const auto set = [](double out[3], const Vec &v) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
  };
  set(camera.look_at, center);
  set(camera.up, up);
  set(camera.eye, toward);
  const View v = view_of(camera);
  double distance = 1e-6;
  // the least distance from which this corner is inside the frame with a margin
  for (int i = 0; i < 8; ++i) {
    const Vec d = Vec{i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z} - center;
    const double wide = std::abs(dot(d, v.right)) / (v.tan_half * aspect);
    const double high = std::abs(dot(d, v.up)) / v.tan_half;
    distance = std::max(distance, 1.1 * std::max(wide, high) + dot(d, v.back));
  }
  set(camera.eye, center + away * distance);
  return camera;
}

Bounds extent_of(const Scene &scene) {
  if (scene.extent && !scene.extent->empty()) return *scene.extent;
  Bounds box = bounds(scene);
  if (box.empty())
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = -1;
      box.hi[k] = 1;
    }
  return box;
}

// A wall covers the box that is beside it; a ramp reaches farther, since things move along it.
Slab slab_of(const Plane &p, const Vec &up, const Bounds &extent) {
  const Vec n = unit(vec(p.normal), up), across = unit(cross(up, n), square_to(n)), along = cross(n, across);
  const Vec lo = vec(extent.lo), hi = vec(extent.hi), middle = (lo + hi) * 0.5, half = (hi - lo) * 0.5;
  const auto reach = [&](const Vec &d) {
    return std::abs(d.x) * half.x + std::abs(d.y) * half.y + std::abs(d.z) * half.z;
  };
  const double size = norm(half), thick = 0.02 * size;
  const bool ramp = dot(n, up) > kRamp;
  const double wide = ramp ? 0.9 * size : 1.02 * reach(across);
  const double high = ramp ? 1.3 * size : 1.02 * reach(along);
  const Vec foot = middle - n * dot(n, middle - vec(p.point));
  return {foot - n * thick,
          {across * std::max(wide, 0.1 * size), along * std::max(high, 0.1 * size), n * thick}};
}

// The extent with the places where planes near it lie across from its middle, so that the walls of a room
// meet each other and the floor.
Bounds room_of(const Scene &scene, const Vec &up, const Bounds &extent) {
  const Vec middle = (vec(extent.lo) + vec(extent.hi)) * 0.5;
  const double size = norm(vec(extent.hi) - middle);
  Bounds room = extent;
  for (const Plane &p : scene.planes) {
    const Vec n = unit(vec(p.normal), up), foot = middle - n * dot(n, middle - vec(p.point));
    if (norm(foot - middle) < 1.5 * size) room.add(&foot.x);
  }
  return room;
}

Camera auto_camera(const Scene &scene, double aspect) {
  const Vec up = unit(vec(scene.up));
  const Bounds extent = extent_of(scene), room = room_of(scene, up, extent);
  Bounds shown = extent;
  for (const Plane &p : scene.planes) {
    const double slope = dot(unit(vec(p.normal), up), up);
    if (slope < kRamp) continue;
    if (!p.slab && slope > kLevel) {
      const Vec middle = (vec(extent.lo) + vec(extent.hi)) * 0.5;
      const Vec foot = middle + up * dot(up, vec(p.point) - middle);
      if (norm(foot - middle) < 1.5 * norm(vec(extent.hi) - middle)) shown.add(&foot.x);
      continue;
    }
    const Slab s = slab_of(p, up, room);
    for (const double side : {-1.0, 1.0})
      for (const double end : {-1.0, 1.0}) {
        const Vec q = s.center + s.axes[0] * side + s.axes[1] * end;
        shown.add(&q.x);
      }
  }
  return auto_camera(shown, aspect, scene.up);
}

Camera follow(const Camera &camera, double distance, const Bounds &box, double aspect) {
  if (box.empty()) return camera;
  constexpr double kInside = 0.92, kNear = 0.8, kFar = 1.25;  // of half the frame; of the distance
  const View v = view_of(camera);
  const double wide = kInside * v.tan_half * aspect, high = kInside * v.tan_half;
  const Vec lo = vec(box.lo), hi = vec(box.hi);
  const double middle = dot(v.eye - (lo + hi) * 0.5, v.back);
  const double ahead =
      std::clamp(middle, kNear * distance, kFar * distance) - middle;  // how far back it goes
  // Corners lie inside where |sideways - shift| <= wide depth: bounds of the shift. Where the lower one is
  // above the upper one the camera goes back, which moves both by wide.
  double left = -1e300, right = 1e300, down = -1e300, top = 1e300, nearest = 1e300;
  for (int i = 0; i < 8; ++i) {
    const Vec d = Vec{i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z} - v.eye;
    const double depth = ahead - dot(d, v.back), x = dot(d, v.right), y = dot(d, v.up);
    left = std::max(left, x - wide * depth);
    right = std::min(right, x + wide * depth);
    down = std::max(down, y - high * depth);
    top = std::min(top, y + high * depth);
    nearest = std::min(nearest, depth);
  }
  const double more =
      std::max({0.0, (left - right) / (2 * wide), (down - top) / (2 * high), 0.1 * distance - nearest});
  const auto shift = [](double low, double up) { return low > 0 ? low : up < 0 ? up : 0; };
  const Vec by = v.right * shift(left - wide * more, right + wide * more) +
                 v.up * shift(down - high * more, top + high * more) + v.back * (ahead + more);
  Camera out = camera;
  for (int k = 0; k < 3; ++k) {
    const double d = k == 0 ? by.x : k == 1 ? by.y : by.z;
    out.eye[k] += d;
    out.look_at[k] += d;
  }
  return out;
}

}  // namespace render
