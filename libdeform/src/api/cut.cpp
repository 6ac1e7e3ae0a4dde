#include "deform/cut.h"

#include <algorithm>
#include <cmath>

#include "api/objects.h"
#include "cut/cut_ahead.h"
#include "cut/planned_cut.h"
#include "cut/separate.h"
#include "snapshot/snapshot_cuts.h"
#include "world/may_cut.h"

using namespace dfm;

namespace {

constexpr double kRounding = 1e-9;  // of the time of a world, which is a sum of steps

CutShape shape_of(const Body &b, const dfm_cut_def &def) {
  if (def.shape > DFM_CUT_PLANE)
    refuse(b,
           ": unknown shape of a cut, %u; use DFM_CUT_ELLIPSOID, DFM_CUT_BOX, DFM_CUT_BLADE or DFM_CUT_PLANE",
           def.shape);
  if (def.how > DFM_CUT_SPLIT)
    refuse(b, ": unknown way of cutting, %u; use DFM_CUT_REMOVE or DFM_CUT_SPLIT", def.how);
  const bool flat = def.shape == DFM_CUT_BLADE || def.shape == DFM_CUT_PLANE;
  if (def.how == DFM_CUT_SPLIT && !flat)
    refuse(b,
           ": DFM_CUT_SPLIT opens faces along a blade or a plane; take the shape DFM_CUT_BLADE or "
           "DFM_CUT_PLANE, or remove cells by DFM_CUT_REMOVE");
  if (!all_finite(def.pose.position, 3) || !all_finite(def.pose.rotation, 4) || !all_finite(def.motion, 3) ||
      !all_finite(def.blade, 12))
    refuse(b, ": pose, motion and blade of a cut must be finite");
  CutShape s;
  s.kind = CutKind(def.shape);
  const Pose pose = to_pose(def.pose);
  s.position = pose.position;
  s.rotation = pose.rotation;
  if (!flat) s.half_size = load3(def.half_size);
  s.way = load3(def.motion);
  for (int k = 0; k < 4; ++k) s.corner[k] = load3(def.blade + 3 * k);
  const double length = norm(s.corner[1]);
  if (def.shape == DFM_CUT_PLANE && !(length > 0 && std::isfinite(length)))
    refuse(b, ": the normal of a plane that cuts it has the length %g; give a direction", length);
  if (!flat)
    for (const double size : def.half_size)
      if (!(size > 0 && std::isfinite(size)))
        refuse(b, ": half_size of a cut has %g m; all three must be positive and finite", size);
  return s;
}

SeparateRule rule_of(const Body &b, const dfm_separate_def *def) {
  const dfm_separate_def own = def ? take_def(def, dfm_separate_def_default()) : dfm_separate_def_default();
  check_flags(own, 0, "dfm_separate_def");
  if (own.crumbs > DFM_CRUMBS_REMOVE)
    refuse(b, ": crumbs %u; use DFM_CRUMBS_STAY or DFM_CRUMBS_REMOVE", own.crumbs);
  return {true, own.crumbs == DFM_CRUMBS_REMOVE, std::max(own.least_cells, 1u)};
}

}  // namespace

dfm_status dfm_body_cut(dfm_body body, const dfm_cut_def *def, dfm_cut_info *out) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    need(def, "def");
    const dfm_cut_def own = take_def(def, dfm_cut_def_default());
    check_flags(own, 0, "dfm_cut_def");
    const CutShape shape = shape_of(b, own);
    const CutReport report = make_cut(b, shape, own.how, own.most);
    if (out) copy_out<dfm_cut_info>(out, report);
  });
}

dfm_status dfm_body_plan_cut(dfm_body body, double t, const dfm_cut_def *def) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    if (!def) return plan_no_cuts(b);
    const double now = b.world->time;
    if (!(t >= now - kRounding * now && std::isfinite(t)))
      refuse(b,
             ": a cut at %g s, and the time of the world is %g s; give a finite time that is not past, or "
             "cut now by dfm_body_cut",
             t, now);
    const dfm_cut_def own = take_def(def, dfm_cut_def_default());
    check_flags(own, 0, "dfm_cut_def");
    plan_cut(b, {t, own.how, own.most, shape_of(b, own)});
  });
}

dfm_status dfm_body_remove_cells(dfm_body body, uint32_t n, const uint32_t *cells, dfm_cut_info *out) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    if (n) need(cells, "cells");
    Array<uint8_t> removed(b.ncell(), 0, b.world->memory());
    for (uint32_t i = 0; i < n; ++i) {
      if (cells[i] >= removed.size())
        refuse(b, " has no cell %u to remove; it has %zu", cells[i], removed.size());
      removed[cells[i]] = 1;
    }
    CutReport report = remove_cells(b, removed);
    separate_if_requested(b, report);
    if (out) copy_out<dfm_cut_info>(out, report);
  });
}

dfm_status dfm_body_origins(dfm_body body, uint32_t capacity_points, uint32_t *points,
                            uint32_t capacity_cells, uint32_t *cells) {
  return as_status(shown_body_of, body, [&](const Body &b) {
    const uint32_t ntet = b.ncell();
    const bool copy_points = points && room(b.p.n, capacity_points, points, nullptr);
    const bool copy_cells = cells && room(ntet, capacity_cells, cells, nullptr);
    for (uint32_t i = 0; copy_points && i < b.p.n; ++i) points[i] = b.cut.whole ? b.cut.point[i] : i;
    for (uint32_t c = 0; copy_cells && c < ntet; ++c) cells[c] = b.cut.whole ? b.cut.cell[c] : c;
  });
}

dfm_status dfm_body_separate(dfm_body body, const dfm_separate_def *def, dfm_cut_info *out) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    const SeparateRule rule = rule_of(b, def);
    CutReport report;
    separate(b, rule, report);
    if (out) copy_out<dfm_cut_info>(out, report);
  });
}

dfm_status dfm_body_set_separate(dfm_body body, const dfm_separate_def *def) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    SeparateRule rule = def ? rule_of(b, def) : SeparateRule{};
    if (rule.on) check_may_cut(b, b.model);
    rule.waits = rule.on && b.separate.waits;
    b.separate = rule;
  });
}

dfm_status dfm_body_set_cut_delay(dfm_body body, double delay) {
  return as_status([&] { set_cut_delay(exclusive(body_of(body)), delay); });
}

dfm_status dfm_body_cut_delay(dfm_body body, double *delay, uint32_t *waiting) {
  return as_status([&] {
    const CutsAhead &a = shown_body_of(body).ahead;
    if (delay) *delay = a.delay;
    if (waiting) *waiting = static_cast<uint32_t>(a.faces.size() + a.later.size());
  });
}

dfm_status dfm_body_pieces(dfm_body body, uint32_t capacity, dfm_body *pieces, uint32_t *n) {
  return as_status(any_body_of, body, [&](const Body &b) {
    const uint64_t whole = b.piece_of ? b.piece_of : b.id;
    std::vector<dfm_body> found;
    for (const Body *const other : all_bodies(*b.world))
      if (other->piece_of == whole) found.push_back(other->handle);
    copy_list(found, capacity, pieces, n);
  });
}
