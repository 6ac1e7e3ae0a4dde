#include "geometry/winding.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "geometry/box_tree.h"

namespace dfm {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Sum of the angles of plane vectors (x, y), in turns, without one arctangent per vector: complex numbers are
// multiplied and the half turns counted by the signs, exactly. libm's atan2 differs between processors in the
// last bit; the one at the end is by halving and a series.
class AngleSum {
 public:
  void add(double x, double y) {
    const double size = std::fabs(x) + std::fabs(y);
    if (!(size > 0)) return;  // the point is a corner of the triangle
    x /= size;
    y /= size;
    const double re = x_ * x - y_ * y, im = x_ * y + y_ * x, scale = 1 / (std::fabs(re) + std::fabs(im));
    const bool upper = y_ >= 0, other = y >= 0;
    if (upper && other && im < 0) ++turns_;
    if (!upper && !other && im >= 0) --turns_;
    x_ = re * scale;
    y_ = im * scale;
  }
  double turns() const {
    double length = std::sqrt(x_ * x_ + y_ * y_), x = x_ / length, y = y_ / length, factor = 1;
    while (x < 0.97) {  // half the angle: at most four times
      if (x < 0) {      // the larger of the two new components first, so that none loses digits
        const double s = std::copysign(std::sqrt((1 - x) / 2), y);
        x = y / (2 * s);
        y = s;
      } else {
        const double c = std::sqrt((1 + x) / 2);
        y = y / (2 * c);
        x = c;
      }
      factor *= 2;
    }
    const double t = y / x, t2 = t * t;
    double series = 0;
    for (int k = 21; k >= 1; k -= 2) series = 1.0 / k - t2 * series;
    return turns_ + factor * t * series / (2 * kPi);
  }

 private:
  double x_ = 1, y_ = 0;
  int turns_ = 0;
};

// Half the solid angle of a triangle seen from the origin is the angle of (x, y) (van Oosterom and
// Strackee 1983, eq. 8).
void add_triangle(AngleSum &sum, Vec3 a, Vec3 b, Vec3 c, double flat = -1) {
  const double la = norm(a), lb = norm(b), lc = norm(c), triple = dot(a, cross(b, c));
  if (std::fabs(triple) <= flat * (la * lb * lc)) return;
  sum.add(la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb, triple);
}

}  // namespace

WindingTree::WindingTree(const Memory &memory, const double *points, uint32_t ntri, const uint32_t *tris)
    : boxes_(memory), corners_(memory) {
  const std::span<const uint32_t> corners{tris, 3 * size_t{ntri}};
  Array<double> x{memory};
  for (const uint32_t c : corners) x.resize(std::max(x.size(), 4 * (size_t{c} + 1)), 0.0);
  for (const uint32_t c : corners) std::copy_n(points + 3 * size_t{c}, 3, &x[4 * size_t{c}]);
  BoxTree tree(memory);
  tree.build(corners, x.data());
  Array<uint32_t> order(tree.triangles());
  boxes_.resize(tree.nodes().size());
  for (size_t k = boxes_.size(); k-- > 0;) {
    const auto [right, count] = tree.nodes()[k];
    Box &box = boxes_[k];
    box.begin = count ? right : boxes_[k + 1].begin;
    box.end = count ? right + count : boxes_[right].end;
    box.right = count ? 0 : right;
    // in a leaf they come in an order of the standard library's own, and they are summed
    if (count) std::sort(order.begin() + right, order.begin() + right + count);
  }
  for (const uint32_t t : order)
    for (size_t k = 0; k < 3; ++k) corners_.push_back(load3(&x[4 * size_t{tris[3 * size_t{t} + k]}]));
  for (Box &box : boxes_) sum_up(box);
}

void WindingTree::sum_up(Box &box) const {
  double weight = 0;
  const auto area_of = [&](uint32_t t) {
    return 0.5 * cross(corners_[3 * size_t(t) + 1] - corners_[3 * size_t(t)],
                       corners_[3 * size_t(t) + 2] - corners_[3 * size_t(t)]);
  };
  const auto center_of = [&](uint32_t t) {
    return (1.0 / 3) * (corners_[3 * size_t(t)] + corners_[3 * size_t(t) + 1] + corners_[3 * size_t(t) + 2]);
  };
  for (uint32_t t = box.begin; t < box.end; ++t) {
    const Vec3 area = area_of(t);
    const double size = norm(area);
    weight += size;
    box.area += area;
    box.center += size * center_of(t);
  }
  box.center = weight > 0 ? (1 / weight) * box.center : corners_[3 * size_t(box.begin)];
  double reach2 = 0;
  for (uint32_t t = box.begin; t < box.end; ++t) {
    const Vec3 area = area_of(t), from = center_of(t) - box.center;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) box.moment[i][j] += from[i] * area[j];
    for (int k = 0; k < 3; ++k) reach2 = std::max(reach2, norm2(corners_[3 * size_t(t) + k] - box.center));
  }
  box.reach = std::sqrt(reach2);
}

double WindingTree::at(Vec3 place, double flat) const {
  AngleSum near;
  double far = 0;
  uint32_t stack[64], top = 0;
  if (!boxes_.empty()) stack[top++] = 0;
  while (top) {
    const uint32_t number = stack[--top];
    const Box &box = boxes_[number];
    const Vec3 r = box.center - place;
    const double r2 = norm2(r), far_off = kFarWinding * box.reach;
    if (r2 > far_off * far_off) {
      // Dipole and its derivative: f = r/r^3, df_j/dr_i = delta_ij/r^3 - 3 r_i r_j/r^5 (Barill et al. 2018,
      // eq. 13 and 14).
      const double i3 = 1 / (r2 * std::sqrt(r2));
      double along = 0;
      for (int i = 0; i < 3; ++i)
        along += r[i] * (box.moment[i][0] * r.x + box.moment[i][1] * r.y + box.moment[i][2] * r.z);
      far +=
          i3 * (dot(r, box.area) + box.moment[0][0] + box.moment[1][1] + box.moment[2][2] - 3 * along / r2);
    } else if (box.right == 0) {
      for (uint32_t t = 3 * box.begin; t < 3 * box.end; t += 3)
        add_triangle(near, corners_[t] - place, corners_[t + 1] - place, corners_[t + 2] - place, flat);
    } else {
      stack[top++] = box.right;
      stack[top++] = number + 1;
    }
  }
  return near.turns() + far / (4 * kPi);
}

double WindingTree::exactly_at(Vec3 place) const {
  AngleSum sum;
  for (size_t t = 0; t < corners_.size(); t += 3)
    add_triangle(sum, corners_[t] - place, corners_[t + 1] - place, corners_[t + 2] - place);
  return sum.turns();
}

}  // namespace dfm
