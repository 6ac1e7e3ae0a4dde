#include "snapshot/snapshot_cuts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "core/error.h"
#include "cut/separate.h"
#include "cut/tool_cut.h"
#include "snapshot/snapshot_things.h"
#include "state/obstacle.h"
#include "state/world.h"

namespace dfm {
namespace {

[[noreturn]] void refuse(const Body &b, const char *what) {
  fail(DFM_E_FORMAT, "the snapshot is damaged: body '%s': %s; nothing was restored", b.name.c_str(), what);
}

template <class List, class Key = std::identity>
bool rises(const List &list, Key key = {}) {
  return std::ranges::adjacent_find(list, std::greater_equal<>{}, key) == list.end();
}

bool has_shape(const Body &b, const CutRow &r) {
  return b.cut.whole && b.tets == r.tets && b.cut.point == r.point && b.cut.cell == r.cell &&
         b.cut.open == r.open && std::equal(b.surface.name, b.surface.name + 3, r.names.of) &&
         b.surface.patch == r.names.of[3] && b.surface.named == r.names.named &&
         std::equal(b.cut.next_name, b.cut.next_name + kFeatureKinds, r.names.next);
}

// Cells and points of a part of the whole body.
void check(const Body &b, const WholeBody &whole, const CutRow &r) {
  const size_t n = whole.tets.size() / 4;
  if (r.cell.empty() || r.tets.size() != 4 * r.cell.size())
    refuse(b, "cells left: expected corners for each");
  if (!rises(r.cell) || r.cell.back() >= n) refuse(b, "cells left: expected numbers of cells, ascending");
  if (std::ranges::any_of(r.point, [&](uint32_t p) { return p >= whole.npoint; }))
    refuse(b, "points left: expected numbers of points");
  std::vector<uint8_t> used(r.point.size());
  for (size_t k = 0; k < r.tets.size(); ++k) {
    if (r.tets[k] >= r.point.size() || r.point[r.tets[k]] != whole.tets[size_t{4} * r.cell[k / 4] + k % 4])
      refuse(b, "corners of cells: expected those of the body as it was made");
    used[r.tets[k]] = 1;
  }
  if (std::find(used.begin(), used.end(), uint8_t{0}) != used.end())
    refuse(b, "points left: expected points that cells have");
  const auto none = [n](uint64_t face) { return face >> 32 >= n || (face & kNone) >= n; };
  if (!rises(r.open) || std::ranges::any_of(r.open, none))
    refuse(b, "open faces: expected pairs of cells, ascending");
}

CutMesh mesh_of(const Memory &m, const CutRow &r) {
  CutMesh out(m);
  out.tets.assign(r.tets.begin(), r.tets.end());
  out.point.assign(r.point.begin(), r.point.end());
  out.cell.assign(r.cell.begin(), r.cell.end());
  return out;
}

CutMesh mesh_of(const Memory &m, const WholeBody &whole) {
  CutMesh out(m);
  out.tets.assign(whole.tets.begin(), whole.tets.end());
  out.point.resize(whole.npoint);
  std::iota(out.point.begin(), out.point.end(), 0u);
  out.cell.resize(whole.tets.size() / 4);
  std::iota(out.cell.begin(), out.cell.end(), 0u);
  return out;
}

void sort_rolled_back(World &w) noexcept {
  std::ranges::sort(w.rolled_back, {}, [](const auto &b) { return b->id; });
}

}  // namespace

bool is_valid(const Array<BladeSide> &sides, size_t ncorner) {
  return rises(sides, &BladeSide::cell) && std::ranges::all_of(sides, [&](const BladeSide &s) {
           return s.cell < ncorner / 4 && s.kind <= SideKind::behind && std::isfinite(s.along) &&
                  std::isfinite(s.way) && std::isfinite(s.off);
         });
}

bool is_valid(const std::vector<PlannedCut> &cuts) {
  const auto earlier = [](const PlannedCut &a, const PlannedCut &b) { return a.t < b.t; };
  return std::is_sorted(cuts.begin(), cuts.end(), earlier) &&
         std::all_of(cuts.begin(), cuts.end(), [](const PlannedCut &c) {
           const CutShape &s = c.shape;
           const bool round = s.kind == CutKind::ellipsoid || s.kind == CutKind::box;
           const bool sized = s.half_size.x > 0 && s.half_size.y > 0 && s.half_size.z > 0;
           return round
                      ? c.how == DFM_CUT_REMOVE && sized
                      : s.kind == CutKind::blade || (norm2(s.corner[1]) > 0 && norm2(s.corner[1]) < HUGE_VAL);
         });
}

bool is_valid(const Array<CutWork> &cut_work, uint32_t npoint) {
  return rises(cut_work, &CutWork::point) && std::ranges::all_of(cut_work, [&](const CutWork &d) {
           return d.point < npoint && d.energy >= 0 && d.force >= 0 && std::isfinite(d.energy) &&
                  std::isfinite(d.force) && std::isfinite(norm2(load3(d.way)));
         });
}

bool is_valid(const Tool::Cuts &cuts, const Tool &tool) {
  if (cuts.how > DFM_CUT_SPLIT || !rises(cuts.bodies)) return false;
  if (cuts.bodies.empty()) return true;
  try {
    check_tool_cuts(tool, cuts.how);
  } catch (const Error &) {
    return false;
  }
  return true;
}

bool is_valid(const std::vector<AheadFace> &faces, const Body &b) {
  const size_t n = b.cut.whole ? b.cut.whole->tets.size() / 4 : b.ncell();
  return rises(faces, &AheadFace::face) && std::ranges::all_of(faces, [n](const AheadFace &f) {
           return (f.face & kNone) < n && f.face >> 32 < (f.face & kNone);
         });
}

std::vector<Body *> all_bodies(const World &w) {
  std::vector<Body *> out;
  for (const auto *list : {&w.bodies, &w.emptied})
    for (const auto &b : *list) out.push_back(b.get());
  std::ranges::sort(out, {}, &Body::id);
  return out;
}

std::vector<CutRow> cut_rows(const World &w) {
  std::vector<CutRow> out;
  for (const Body *const b : all_bodies(w)) {
    if (!b->cut.whole && !b->emptied) continue;
    CutRow &r = out.emplace_back();
    r.id = b->id;
    r.piece_of = b->piece_of;
    if (b->piece_of) r.name = b->name;
    r.emptied = b->emptied;
    if (b->emptied) continue;
    r.tets = b->tets;
    r.point = b->cut.point;
    r.cell = b->cut.cell;
    r.open = b->cut.open;
    std::copy(b->surface.name, b->surface.name + 3, r.names.of);
    r.names.of[3] = b->surface.patch;
    r.names.named = b->surface.named;
    std::copy(b->cut.next_name, b->cut.next_name + kFeatureKinds, r.names.next);
  }
  return out;
}

// The body, made by the host, of which this one is a piece; itself if it is no piece.
Body &SnapshotShapes::whole_body(Body &b) {
  if (!b.piece_of) return b;
  for (Body *const other : all_bodies(w_))
    if (other->id == b.piece_of && !other->piece_of) return *other;
  refuse(b, "a piece: expected one of a body of this world");
}

// Adds the pieces of the snapshot and removes the others; their shapes follow later.
void SnapshotShapes::find_pieces(const std::vector<CutRow> &rows) {
  const std::vector<Body *> bodies = all_bodies(w_);
  reserve_places(w_, rows.size());
  undo_.reserve(3 * (bodies.size() + w_.rolled_back.size() + rows.size()));
  const auto note = [&](Body &b) { undo_.push_back({&b, b.id, b.emptied, b.rolled_back, nullptr}); };
  for (const auto &p : w_.rolled_back) note(*p);
  const auto move = [&](Body &b, bool rolled_back) {
    note(b);
    set_place(w_, b, b.emptied && rolled_back, rolled_back);
  };
  for (Body *const b : bodies) {
    if (!b->piece_of) continue;
    const auto row = std::ranges::find(rows, b->id, &CutRow::id);
    if (row != rows.end() && row->piece_of == b->piece_of && row->name == b->name) continue;
    move(*b, true);
  }
  for (const CutRow &r : rows) {
    const std::vector<Body *> now = all_bodies(w_);
    if (!r.piece_of || std::ranges::find(now, r.id, &Body::id) != now.end()) continue;
    const auto whole = std::find_if(now.begin(), now.end(),
                                    [&](const Body *b) { return b->id == r.piece_of && !b->piece_of; });
    if (whole == now.end() || r.id <= r.piece_of || r.name.empty() || w_.find_body(r.name) ||
        w_.find_obstacle(r.name))
      fail(DFM_E_FORMAT,
           "the snapshot is damaged: piece '%s': expected one of a body of this world, with a name of its "
           "own; nothing was restored",
           r.name.c_str());
    move(place_for_piece(w_, **whole, r.id, r.name), false);
  }
}

void SnapshotShapes::put(Body &b, CutRow *row) {
  const Memory &m = w_.memory();
  const bool emptied = row && row->emptied;
  undo_.push_back({&b, b.id, b.emptied, b.rolled_back, nullptr});
  if (row && row->piece_of != b.piece_of) refuse(b, "a piece: expected it of another body");
  set_place(w_, b, emptied, false);
  if ((emptied && b.p.n > 0) || (row ? has_shape(b, *row) : !b.cut.whole)) return;
  Body &like = whole_body(b);
  if (!like.surface.identity()) refuse(b, "cells left: expected a body that cells can be cut from");
  const std::shared_ptr<const WholeBody> whole = whole_of(like);
  Array<uint64_t> open{m};
  if (row && !emptied) {
    check(b, *whole, *row);
    open.assign(row->open.begin(), row->open.end());
    undo_.back().shape = restore_shape(b, like, whole, mesh_of(m, *row), std::move(open), &row->names);
  } else {
    undo_.back().shape = restore_shape(b, like, whole, mesh_of(m, *whole), std::move(open), nullptr);
  }
}

SnapshotShapes::SnapshotShapes(World &w, std::vector<CutRow> &rows) : w_(w) {
  size_t found = 0;
  try {
    find_pieces(rows);
    for (Body *const b : all_bodies(w)) {
      const auto row = std::ranges::find(rows, b->id, &CutRow::id);
      found += row != rows.end();
      put(*b, row == rows.end() ? nullptr : &*row);
    }
    if (found != rows.size())
      fail(DFM_E_FORMAT,
           "the snapshot is damaged: cut body: expected a body of this world, once; nothing was restored");
  } catch (...) {
    take_back();
    throw;
  }
}

SnapshotShapes::~SnapshotShapes() { take_back(); }

void SnapshotShapes::take_back() noexcept {
  for (; !undo_.empty(); undo_.pop_back()) {
    Undo &u = undo_.back();
    if (u.shape) exchange(*u.body, *u.shape);
    if (u.body->id != u.id) {
      u.body->id = u.id;
      sort_rolled_back(w_);
    }
    set_place(w_, *u.body, u.emptied, u.rolled_back);
  }
}

}  // namespace dfm
