// Triangle pairs that cross, by exact predicates: the judge of "nothing passes through". It shares no code
// with the library's detection, and sees positions only as the public API reports them.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace crossing {

// Sign of the volume of (a, b, c, d): > 0 if d lies on the side of triangle abc from which a, b, c turn
// clockwise; 0: coplanar. Exact.
int orientation(const double a[3], const double b[3], const double c[3], const double d[3]);
// Sign of the area of (a, b, c) in the plane of two axes: > 0 counter-clockwise. Exact.
int orientation(const double a[3], const double b[3], const double c[3], int axis_u, int axis_v);

using Triangle = const double *[3];
// The closed triangles share at least one point (touching included). A triangle without area counts as its
// edges; two of those never meet.
bool meet(const Triangle a, const Triangle b);
// How deep an edge of one goes through the other, in m: the shortest way of an end of the edge, or of where
// it goes through, to the border of the other triangle or to its plane; below 0: none does. Rounded.
double depth(const Triangle a, const Triangle b);
// They meet along more than a point, and each has corners strictly on both sides of the other's plane: they
// pass through each other rather than touch.
bool pass_through(const Triangle a, const Triangle b);

// obstacle: pairs of its triangles among themselves or with another obstacle's are not counted.
// cut: its cut faces lie on each other, or on those of its pieces. whole: the same for parts of one body; 0:
// of none.
struct Surface {
  const double *xyz;
  uint32_t n;
  const uint32_t *tri;
  uint32_t ntri;
  bool obstacle = false, cut = false;
  uint64_t whole = 0;
};

// Committed states keep a distance between surfaces, so there any shared point counts; a start state is the
// user's own, and may touch.
enum class Touching { counts, allowed };

// Triangle pairs of two surfaces, and of one surface with itself.
// Two that are `cut` cross only where the depth is above kLaid of the longest edge of the two triangles: cut
// faces are kept apart to rest distances of contacts.
inline constexpr double kLaid = 5e-3;
// parts: those of two parts of one body, of `between`. Which surfaces cross: of the first pair of each kind.
struct Found {
  size_t between = 0, within = 0, parts = 0;
  uint32_t crossed = 0, crossing[2] = {0, 0}, parted[2] = {0, 0};
  size_t all() const { return between + within; }
};

class Counter {
 public:
  // Pairs within and between surfaces; pairs of one surface that share a vertex (by number or by position)
  // are excepted. Coordinates must be finite, and below 1e90 for the exact signs not to overflow.
  // joined: pairs of surfaces, ascending, that are attached to each other and may coincide; not counted
  Found count(const std::vector<Surface> &surfaces, Touching touching,
              const std::vector<std::array<uint32_t, 2>> &joined = {});

 private:
  struct Box { double lo[3], hi[3]; };
  // left 0: leaf
  struct Node {
    Box box;
    uint32_t begin, end, left, right;
  };
  struct Item {
    Box box;
    uint32_t surface, triangle;
  };
  uint32_t build(uint32_t begin, uint32_t end);
  void within(uint32_t node);
  void between(uint32_t a, uint32_t b);
  void test(const Item &a, const Item &b);

  const std::vector<Surface> *surfaces_ = nullptr;
  Touching touching_ = Touching::counts;
  const std::vector<std::array<uint32_t, 2>> *joined_ = nullptr;
  std::vector<Item> items_;
  std::vector<Node> nodes_;
  Found found_;
};

}  // namespace crossing
