// Record of a body that has been cut: the body as it was made, and the origin of its points and cells.
#pragma once
#include <algorithm>
#include <memory>
#include <vector>

#include "body/zones.h"
#include "core/memory.h"
#include "geometry/cut_shape.h"
#include "geometry/surface.h"
#include "state/model_choice.h"

namespace dfm {

struct Body;
struct CutJob;

// When separate parts of a body become bodies (dfm_body_set_separate).
struct SeparateRule {
  bool on = false;
  bool removes = false;  // parts of fewer cells than `least` are removed; else they stay
  uint32_t least = 1;    // cells
  bool waits = false;    // no memory to make bodies of the parts: each step tries again
};

// A body as it was made.
struct WholeBody {
  uint32_t npoint = 0, nsurfel = 0;
  Array<double> rest, mass, share;  // [npoint,3] m, [npoint] kg; [ntet] or empty
  Array<uint32_t> tets, tri;        // [ntet,4]; [ntri,3] points of the surface's triangles
  Composition composition;
  SurfaceZones zones;
};

// How the side of a blade's way on which the middle of a cell lies is known. ahead: the edge has not reached
// it; passed: from when the edge passed it; behind: the cell was behind the edge at the start.
enum class SideKind : uint32_t { none = 0, ahead = 1, passed = 2, behind = 3 };
struct BladeSide {
  uint32_t cell;
  SideKind kind;
  double along, way, off;  // along the edge, 0 to 1; m on the blade's way; m from it
};

// Energy of a cut, at a point of the body beside it, that is not yet taken from the tool. A force on the
// point takes it along the path that follows (step/solve/cut_drag.h).
struct CutWork {
  double energy, force;  // J; N
  double way[3];         // unit length, of the edge through the material; in the frame of the tool's part
  uint32_t point, unused = 0;  // no gap at the end: snapshots have its bytes
};

// The last place of a blade's edge, and the points of the body at that time: the next way of the blade is
// measured relative to the motion of the body.
struct BladeTrack {
  double edge[6] = {};      // m
  Array<double> x;          // [npoint,4] m
  Vec3 lead;                // m, way of late; zero where the blade itself says where it looks
  double way[2] = {};       // m, that each end has moved
  Array<BladeSide> sides;   // of cells near it, ascending
  double credit = 0;        // J, zero or less: the sum of work since it was last the largest
  uint64_t part = 0;        // id of the obstacle that is the tool's part; 0: of dfm_body_cut
  Array<CutWork> cut_work;  // by point, ascending
};

// A planned cut (dfm_body_plan_cut).
struct PlannedCut {
  double t = 0;       // s
  uint32_t how = 0;   // DFM_CUT_REMOVE or DFM_CUT_SPLIT
  uint32_t most = 0;  // cells or faces; 0: all
  CutShape shape;
};

struct CutRecord {
  std::shared_ptr<const WholeBody> whole;  // null: no cut has been made
  Array<uint32_t> point, cell;             // [npoint], [ntet] numbers in the whole body
  Array<uint64_t> open;  // faces between cells of the whole body (mesh/cut_mesh.h), ascending
  uint32_t next_name[kFeatureKinds] = {};  // of features of the surface (geometry/surface.h)
};

// Cuts of a body by tools that are made ahead, beside the steps (cut/cut_ahead.h).
// A face that a tool has come through, and that has not opened yet.
struct AheadFace {
  uint64_t face;  // between cells of the whole body (mesh/cut_mesh.h)
  uint64_t by;    // id of the tool's part
  bool operator<(const AheadFace &o) const { return face < o.face; }
};

struct CutsAhead {
  double delay = 0;                     // s; 0: faces open in the step in which a tool comes through
  std::vector<AheadFace> faces, later;  // that open at `open_time`, and `delay` after that; both ascending
  double open_time = 0;                 // s
  // Derived: what a cut needs of the body, and the cut that is being made. Not in snapshots.
  std::shared_ptr<const Body> structure;
  std::shared_ptr<CutJob> job;

  bool has(uint64_t face) const {
    const auto in = [&](const std::vector<AheadFace> &list) {
      return std::binary_search(list.begin(), list.end(), AheadFace{face, 0});
    };
    return in(faces) || in(later);
  }
};

}  // namespace dfm
