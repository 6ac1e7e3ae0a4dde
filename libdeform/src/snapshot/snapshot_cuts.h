// The cells of the bodies in a snapshot. A restore reads this first and gives the world's bodies these cells,
// so that all other fields find arrays of the right length; if it fails later, the bodies get their own cells
// back.
#pragma once
#include <string>
#include <vector>

#include "cut/body_shape.h"
#include "snapshot/snapshot_stream.h"
#include "state/tool.h"

namespace dfm {

// One row for each body that has been cut, and for each piece. emptied: it has no cells, and the lists are
// empty.
struct CutRow {
  uint64_t id = 0, piece_of = 0;  // as in Body
  std::string name;               // of a piece
  bool emptied = false;
  Array<uint32_t> tets, point, cell;  // as in CutRecord
  Array<uint64_t> open;
  FeatureNames names;
};

std::vector<CutRow> cut_rows(const World &w);

template <class Stream, class Rows>
void cut_fields(Stream &s, Rows &rows) {
  s.list("bodies that have been cut", rows, [&](auto &r) {
    s.value("cut body", r.id, must::any);
    s.value("piece of", r.piece_of, must::any);
    s.array("name of a piece", r.name, kAnyCount, must::any);
    s.value("without cells", r.emptied, must::flag);
    s.array("cells left", r.cell, kAnyCount, must::any);
    s.array("corners of cells", r.tets, kAnyCount, must::any);
    s.array("points left", r.point, kAnyCount, must::any);
    s.array("open faces", r.open, kAnyCount, must::any);
    for (auto &names : r.names.of) s.array("names of features", names, kAnyCount, must::any);
    for (auto &next : r.names.next) s.value("next name", next, must::any);
    s.array("names given elsewhere", r.names.named, kAnyCount, must::any);
  });
}

// During its lifetime the world's bodies have the cells of the rows; keep() makes that permanent.
class SnapshotShapes {
 public:
  // Throws Error; then the world is unchanged.
  SnapshotShapes(World &w, std::vector<CutRow> &rows);
  SnapshotShapes(const SnapshotShapes &) = delete;
  ~SnapshotShapes();
  void keep() noexcept { undo_.clear(); }

 private:
  struct Undo {
    Body *body;
    uint64_t id;
    bool emptied, rolled_back;
    std::unique_ptr<BodyShape> shape;  // null: unchanged
  };
  void find_pieces(const std::vector<CutRow> &rows);
  Body &whole_body(Body &b);
  void put(Body &b, CutRow *row);
  void take_back() noexcept;
  World &w_;
  std::vector<Undo> undo_;
};

// All bodies in id order, including those without cells; not the pieces that a restore has removed.
std::vector<Body *> all_bodies(const World &w);

// Whether they are cells of a mesh that has ncorner corners of cells, ascending.
bool is_valid(const Array<BladeSide> &sides, size_t ncorner);
bool is_valid(const Array<CutWork> &cut_work, uint32_t npoint);
bool is_valid(const std::vector<PlannedCut> &cuts);
// Whether the tool can cut in this way.
bool is_valid(const Tool::Cuts &cuts, const Tool &tool);
// Between cells of the whole body, ascending.
bool is_valid(const std::vector<AheadFace> &faces, const Body &b);

}  // namespace dfm
