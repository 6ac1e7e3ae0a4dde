// Surfaces: triangles are listed by their corners' places, and the repair of read surfaces joins and turns
// them. Corners that meet are computed by the same operations on the same numbers, so they come out the
// same to the bit.
#include "mesh/generate.h"
#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

class Soup {
 public:
  explicit Soup(const Memory &memory) : raw_(memory) {}
  void triangle(Vec3 a, Vec3 b, Vec3 c) {
    for (const Vec3 p : {a, b, c}) {
      raw_.tris.push_back(raw_.npoint());
      raw_.points.insert(raw_.points.end(), {p.x, p.y, p.z});
    }
  }
  // Corners around; the diagonal from the first where `first`, else from the second.
  void square(Vec3 a, Vec3 b, Vec3 c, Vec3 d, bool first) {
    if (first) {
      triangle(a, b, c);
      triangle(a, c, d);
    } else {
      triangle(b, c, d);
      triangle(b, d, a);
    }
  }
  RestMesh finish() {
    RestMesh mesh = finish_surface("generator", std::move(raw_));
    for (uint32_t p = 0; p < mesh.npoint(); ++p) mesh.file_point[p] = p;
    mesh.merged_points = mesh.turned = 0;
    mesh.warnings.clear();
    return mesh;
  }

 private:
  RawMesh raw_;
};

void check_triangles(uint32_t triangles) {
  if (triangles < 1 || triangles > kMaxCells)
    fail(DFM_E_ARG, "the number of triangles is %u; expected 1 to %u", triangles, kMaxCells);
}

// Two annuli of triangular lattice at heights 0 and `length`.
void add_annuli(Soup &soup, double inner, double outer, double length, uint32_t rings, uint32_t n) {
  for (const double z : {0.0, length})
    for (uint32_t k = 0; k < rings; ++k)
      for (uint32_t j = 0; j < n; ++j) {
        const auto at = [&](uint32_t ring, uint32_t place) {
          const Vec3 p = on_annulus(inner, outer, ring, rings, place % n, n);
          return Vec3{p.x, p.y, z};
        };
        soup.triangle(at(k, j), at(k, j + 1), at(k + 1, j + k % 2));
        soup.triangle(at(k + 1, j), at(k + 1, j + 1), at(k, j + 1 - k % 2));
      }
}

template <class At>
void add_side(Soup &soup, uint32_t around, uint32_t along, double length, const At &at) {
  for (uint32_t i = 0; i < along; ++i)
    for (uint32_t j = 0; j < around; ++j) {
      const Vec3 p = at(j), q = at((j + 1) % around);
      const double low = length * (double(i) / along), high = length * (double(i + 1) / along);
      soup.square({p.x, p.y, low}, {q.x, q.y, low}, {q.x, q.y, high}, {p.x, p.y, high}, (i + j) % 2);
    }
}

}  // namespace

RestMesh make_ball_surface(const Memory &memory, double radius, uint32_t triangles) {
  check_size("ball's radius", radius);
  check_triangles(triangles);
  const uint32_t n = rounded(std::sqrt(triangles / 20.0));
  const Icosahedron ico;
  Soup soup(memory);
  for (const auto &face : ico.face) {
    const auto at = [&](uint32_t i, uint32_t j) {
      return radius * normalized(double(n - i - j) * ico.corner[face[0]] + double(i) * ico.corner[face[1]] +
                                 double(j) * ico.corner[face[2]]);
    };
    for (uint32_t i = 0; i < n; ++i)
      for (uint32_t j = 0; i + j < n; ++j) {
        soup.triangle(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n) soup.triangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
  }
  return soup.finish();
}

RestMesh make_beam_surface(const Memory &memory, double x, double y, double z, uint32_t triangles) {
  check_beam(x, y, z);
  check_triangles(triangles);
  const double size[3] = {x, y, z}, squares = std::max(6.0, triangles / 2.0);
  const auto cut = [&](double edge, std::array<uint32_t, 3> &n) {
    for (size_t k = 0; k < 3; ++k) n[k] = rounded(std::min(1e4, size[k] / edge));
    return 2.0 * (double(n[0]) * n[1] + double(n[1]) * n[2] + double(n[2]) * n[0]);
  };
  double edge = std::sqrt(2 * (x * y + y * z + z * x) / squares);
  Best<std::array<uint32_t, 3>> found{{1, 1, 1}};
  for (int finer = 0; finer < 48; ++finer, edge *= 0.95) {
    std::array<uint32_t, 3> n;
    const double count = cut(edge, n), h[3] = {x / n[0], y / n[1], z / n[2]};
    found.offer(choice_score(std::max({h[0], h[1], h[2]}) / std::min({h[0], h[1], h[2]}), count, squares), n);
  }
  const std::array<uint32_t, 3> best = found.choice;
  check_choice("beam's surface",
               4.0 * (double(best[0]) * best[1] + double(best[1]) * best[2] + double(best[2]) * best[0]),
               triangles);
  Soup soup(memory);
  for (int axis = 0; axis < 3; ++axis)
    for (const uint32_t side : {0u, best[axis]}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto at = [&](uint32_t i, uint32_t j) {
        Vec3 p;
        p[axis] = size[axis] * (double(side) / best[axis]);
        p[u] = size[u] * (double(i) / best[u]);
        p[v] = size[v] * (double(j) / best[v]);
        return p;
      };
      for (uint32_t i = 0; i < best[u]; ++i)
        for (uint32_t j = 0; j < best[v]; ++j)
          soup.square(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1), (i + j) % 2);
    }
  return soup.finish();
}

RestMesh make_cylinder_surface(const Memory &memory, double radius, double length, uint32_t triangles) {
  check_cylinder(radius, length);
  check_triangles(triangles);
  Best<std::array<uint32_t, 2>> best{{1, 1}};
  for (uint32_t rings = 1; rings == 1 || 12.0 * rings * rings <= std::max(4.0 * triangles, 2e5); ++rings) {
    const double h = radius / rings;
    for (const double wanted : {length / h, triangles / (12.0 * rings) - rings}) {
      const uint32_t layers = rounded(std::min(wanted, 1e7));
      best.offer(choice_score(apart(length / layers, h), 12.0 * rings * (double(rings) + layers), triangles),
                 {rings, layers});
    }
  }
  const uint32_t n = best.choice[0], m = best.choice[1];
  check_choice("cylinder's surface", 12.0 * n * (double(n) + m), triangles);
  Soup soup(memory);
  const auto at = [&](uint32_t ring, uint32_t j) {
    return ring == 0 ? Vec3{} : (radius * (double(ring) / n)) * unit_on_circle(j % (6 * ring), 6 * ring);
  };
  for (const double z : {0.0, length}) {
    const auto cap = [&](Vec3 a, Vec3 b, Vec3 c) {
      a.z = b.z = c.z = z;
      soup.triangle(a, b, c);
    };
    for (uint32_t k = 1; k <= n; ++k)
      for (uint32_t s = 0; s < 6; ++s)
        for (uint32_t t = 0; t < k; ++t) {
          const uint32_t outer = s * k + t, inner = s * (k - 1) + t;
          cap(at(k - 1, inner), at(k, outer), at(k, outer + 1));
          if (t + 1 < k) cap(at(k - 1, inner), at(k, outer + 1), at(k - 1, inner + 1));
        }
  }
  add_side(soup, 6 * n, m, length, [&](uint32_t j) { return at(n, j); });
  return soup.finish();
}

RestMesh make_tube_surface(const Memory &memory, double inner, double outer, double length,
                           uint32_t triangles) {
  check_tube(inner, outer, length);
  check_triangles(triangles);
  const double wall = outer - inner, round = kTwoPi * (0.5 * (inner + outer)), area = 2 * (length + wall);
  Best<std::array<uint32_t, 3>> best{{3, 1, 1}};
  double edge = std::sqrt(2 * round * area / triangles);
  for (int finer = 0; finer < 48; ++finer, edge *= 0.95) {
    const uint32_t n = std::max(3u, rounded(std::min(1e7, round / edge)));
    const uint32_t k = rounded(std::min(1e4, wall / edge / kRow)), m = rounded(std::min(1e7, length / edge));
    const double h[3] = {round / n, wall / k / kRow, length / m};
    best.offer(choice_score(std::max({h[0], h[1], h[2]}) / std::min({h[0], h[1], h[2]}),
                            4.0 * n * (double(k) + m), triangles),
               {n, k, m});
  }
  const uint32_t around = best.choice[0], across = best.choice[1], along = best.choice[2];
  check_choice("tube's surface", 4.0 * around * (double(across) + along), triangles);
  Soup soup(memory);
  add_annuli(soup, inner, outer, length, across, around);
  for (const uint32_t ring : {0u, across})
    add_side(soup, around, along, length,
             [&](uint32_t j) { return on_annulus(inner, outer, ring, across, j, around); });
  return soup.finish();
}

RestMesh make_torus_surface(const Memory &memory, double ring, double radius, uint32_t triangles) {
  check_size("torus's ring radius", ring);
  check_size("torus's tube radius", radius);
  check_triangles(triangles);
  if (!(radius < ring))
    fail(DFM_E_ARG, "the torus's tube radius is %g m; expected less than the ring radius, %g m", radius,
         ring);
  // around the tube, in edges, where both ways have the same
  const double small = std::sqrt(radius / ring * (triangles * 0.5 * kRow));
  const auto whole = [](double n) { return rounded(std::min(n, 1e7)); };
  const uint32_t around = std::max(3u, whole(small));
  const uint32_t along = 2 * std::max(2u, whole(small * (ring / radius) / (2 * kRow)));
  check_choice("torus", 2.0 * around * along, triangles);
  Soup soup(memory);
  const auto at = [&](uint32_t i, uint32_t j) {  // odd rows are shifted by half a step
    const Vec3 u = unit_on_circle(2 * uint64_t(j % around) + i % 2, 2 * uint64_t(around));
    const Vec3 v = unit_on_circle(i % along, along);
    const double r = ring + radius * u.x;
    return Vec3{r * v.x, r * v.y, radius * u.y};
  };
  for (uint32_t i = 0; i < along; ++i)
    for (uint32_t j = 0; j < around; ++j) {
      soup.triangle(at(i, j), at(i, j + 1), at(i + 1, j + i % 2));
      soup.triangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1 - i % 2));
    }
  return soup.finish();
}

}  // namespace dfm
