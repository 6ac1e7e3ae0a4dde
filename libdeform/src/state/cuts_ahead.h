// Cuts of a body by tools that are made ahead, beside the steps (world/cut_ahead.h).
#pragma once
#include <algorithm>
#include <memory>
#include <vector>

namespace dfm {

struct Body;
struct CutJob;

// A face that a tool has come through, and that has not opened yet.
struct AheadFace {
  uint64_t face;  // between cells of the whole body (mesh/cut_mesh.h)
  uint64_t by;    // id of the tool's part
  bool operator<(const AheadFace &o) const { return face < o.face; }
};

struct CutsAhead {
  double delay = 0;                     // s; 0: faces open in the step in which a tool comes through
  std::vector<AheadFace> faces, later;  // that open at `due`, and `delay` after that; both ascending
  double due = 0;                       // s
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
