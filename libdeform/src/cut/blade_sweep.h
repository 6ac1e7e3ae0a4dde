// Faces between cells that a moving edge passes, while the body moves too.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "geometry/cut_shape.h"
#include "state/body.h"

namespace dfm {

struct SweptFace {
  double order;   // along the way of the edge
  uint64_t face;  // between present cells (mesh/cut_mesh.h)
  double work;    // J, that opening it takes: below zero where the face leans back over the blade's way
  Vec3 way;       // m, of the edge relative to the face
  double along;   // where the edge meets it: 0 one end, 1 the other
  bool operator<(const SweptFace &o) const { return order != o.order ? order < o.order : face < o.face; }
};

// [n,2] cells on both sides of the inner faces of a body, in the order of the points of these (Body::inner).
Array<uint32_t> inner_faces(const Body &b);

// From the edge of corners 0 and 1 to that of 3 and 2. If the body remembers that an edge has come to the
// first one, the way goes on from there.
class BladeSweep {
 public:
  // forward [2]: where the blade looks at the start and at the end, at right angles to its edge; null: where
  // it goes.
  BladeSweep(Body &b, const CutShape &blade, const Vec3 *forward);
  // In the order in which the edge meets them; none of them is open.
  std::vector<SweptFace> faces;
  bool goes_on(const BladeTrack &track) const;   // does it begin where this one has come to?
  bool near() const { return !cells_.empty(); }  // is the body?
  // J, zero or more: opening the first n of the faces. Faces of a rough cut count as the blade sees
  // them, with a sign: the sum over a cut is what the blade has passed over, but on the way it may fall. What
  // a cut has taken is the largest sum so far, so that none gives energy back. To be asked once, before
  // keep().
  double energy(size_t n);
  // The body remembers the edge, after faces have been opened and before anything else has changed.
  BladeTrack &keep(Body &b, uint64_t part = 0);

 private:
  struct Face { uint32_t i, j; };  // of cells_

  void find_near(const Body &b);
  bool turn(const Body &b, const Vec3 *forward);
  void find_faces(const Body &b);
  void take_sides(const BladeTrack *track);
  void compare(const Body &b, bool by_shape);
  bool still() const;
  std::span<const Face> pairs() const { return {pairs_.get(), npair_}; }

  struct Frame {
    Vec3 origin, along, forward, normal;
    double length = 0;
    Frame() = default;
    Frame(Vec3 a, Vec3 b, Vec3 towards);
  };

  CutShape blade_;
  size_t track_;
  bool fresh_ = true;
  // The cells near the edge, ascending. There may be thousands, and few are at the edge: what is looked at
  // for all of them is little, and together in memory.
  std::vector<uint32_t> cells_, place_;  // place_ [ncell]: of each cell in cells_, or kNone
  std::unique_ptr<double[]> was_, is_;   // [cells_,4] m, their middles
  std::unique_ptr<double[]> ahead_;      // m, of the edge now
  std::vector<SideKind> kind_;
  std::unique_ptr<BladeSide[]> sides_;  // of those that have one
  std::unique_ptr<Face[]> pairs_;
  uint32_t npair_ = 0;
  Vec3 drift_, lead_;  // m: mean motion of the cells; way of the edge, of late
  Frame from_, to_;
  double way_[2] = {};   // m, that the ends have come forward since the track began
  double step_[2] = {};  // m, of these in this call
  double strip_ = 0;     // m, behind the edge as it began, that is cut too
  double apart_ = 0;     // m, largest distance between the middles of two neighbors
  double credit_ = 0;    // J, zero or less: the sum of work less its largest so far
};

}  // namespace dfm
