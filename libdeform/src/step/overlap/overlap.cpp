#include "step/overlap/overlap.h"

#include <algorithm>

#include "body/obstacle_mesh.h"
#include "contact/reach.h"
#include "core/error.h"
#include "dynamics/rigid/rigid_set.h"
#include "math/extent.h"
#include "plugin/context.h"
#include "state/world.h"
#include "step/messages.h"
#include "step/overlap/overlap_sides.h"

namespace dfm {

uint64_t made_id(const Body &b) { return b.piece_of ? b.piece_of : b.id; }
namespace {

constexpr uint64_t kReleaseEvery = 16;          // steps: interval at which excluded pairs are tested
constexpr uint64_t kPiece = uint64_t{1} << 63;  // added to ids in Overlaps::placed by place_piece()
constexpr size_t kSentences = 8;                // number of pairs that the log names individually
constexpr double kOtherUnits = 100;             // times the size of a body: an obstacle may be in millimeters
constexpr double kReportAgain = 2;              // times the depth of parts in the log

// Whether the overlap is too deep for contact to resolve. Closed shapes and voxels resolve any depth;
// triangles only small ones.
bool deep(const World &w, const OverlapPair &p, const Crossed &c) {
  if (p.obstacle && !w.obstacles[p.b]->mesh) return false;
  const Surface &a = w.bodies[p.a]->surface;
  const Surface &b = p.obstacle ? w.obstacles[p.b]->mesh->surface : w.bodies[p.b]->surface;
  return c.coincide || c.mostly || c.depth > std::min(recovery_depth(a), recovery_depth(b));
}

uint64_t other_id(const World &w, const OverlapPair &p) {
  return p.obstacle ? w.obstacles[p.b]->id : w.bodies[p.b]->id;
}

bool parts_of_one(const World &w, const OverlapPair &p) {
  return !p.obstacle && made_id(*w.bodies[p.a]) == made_id(*w.bodies[p.b]);
}

// Parts of what was one body lie on each other where they were one, with the faces of the cut set back by
// half of the rest distance each. A depth within that is their normal place, no overlap.
bool lie_on_cut(const World &w, const OverlapPair &p, const Crossed &c) {
  return parts_of_one(w, p) && c.depth <= w.offset && !deep(w, p, c);
}

std::vector<Overlap> find_overlaps(World &w) {
  std::vector<uint64_t> &placed = w.overlaps.placed;
  std::sort(placed.begin(), placed.end());
  const auto was_placed = [&](uint64_t id) {
    return w.overlaps.all || std::binary_search(placed.begin(), placed.end(), id);
  };
  const auto body_was_placed = [&](uint64_t id) { return was_placed(id) || was_placed(id | kPiece); };
  // Sides of a slit that cross when a part comes off keep the contact that they had.
  const auto kept = [&](const OverlapPair &p, uint64_t a, uint64_t b) {
    return parts_of_one(w, p) && !was_placed(a) && !was_placed(b);
  };
  std::vector<Overlap> out;
  OverlapSides sides(w);
  const auto look = [&](const OverlapPair &p) {
    const uint64_t a = w.bodies[p.a]->id, b = other_id(w, p);
    if ((!body_was_placed(a) && !body_was_placed(b)) || !sides.may_touch(p)) return;
    const Crossed c = sides.look(p, w.offset, false);
    if (!c.through || lie_on_cut(w, p, c)) return;
    out.push_back({a, b, p.obstacle, c.crossings, c.enclosed, c.depth, deep(w, p, c) && !kept(p, a, b)});
    // after a restore all counts as placed, and nobody has moved anything
    if (kept(p, a, b) || (parts_of_one(w, p) && w.overlaps.report_only))
      out.back().whole = made_id(*w.bodies[p.a]);
  };
  for (uint32_t i = 0; i < w.bodies.size(); ++i) {
    for (uint32_t j = i + 1; j < w.bodies.size(); ++j) look({i, j, false});
    for (uint32_t j = 0; j < w.obstacles.size(); ++j) look({i, j, true});
  }
  return out;
}

// A body of centimeters in a mesh of a hundred times its size that it overlaps: one of the two files is in
// millimeters.
std::string hint_of_units(const Body &b, const Obstacle *o) {
  if (!o || o->points.empty()) return {};
  const double own = extent_of(b.p.x.data(), b.p.n, kStride).diagonal();
  const double its = extent_of(o->points).diagonal();
  if (!(its > kOtherUnits * own)) return {};
  return format(
      "; '%s' is %.3g m across and '%s' %.3g m: if a mesh is in millimeters, multiply its points by "
      "0.001 (in a scene: \"scale\": 0.001 in its \"pose\")",
      b.name.c_str(), own, o->name.c_str(), its);
}

// The name under which the user has made it: a piece has come during the run, and cannot be put elsewhere.
const std::string &made_name(const Body &b) { return b.piece_of ? b.whole_name : b.name; }

std::string remedy(World &w, const Overlap &o, bool untangled) {
  const Body &a = *w.body(o.a);
  const Obstacle *const thing = o.obstacle ? w.obstacle(o.b) : nullptr;
  const std::string what =
      o.suspended ? "contact between them is off until they are apart" : "contact pushes them apart slowly";
  const Body *const b = thing ? nullptr : w.body(o.b);
  const bool came = a.piece_of || (b && b->piece_of);
  const std::string &first = made_name(a), &second = thing ? thing->name : made_name(*b);
  const std::string where = !came ? "move one of them"
                            : first == second
                                ? format("move '%s' at the start", first.c_str())
                                : format("move '%s' or '%s' at the start", first.c_str(), second.c_str());
  const std::string held = thing ? hint_of_attachment(w, a.id) : "";  // untangle moves none that is held
  return what + "; " + where + (untangled || !held.empty() ? "" : ", or set \"untangle\"") + held +
         (came ? "" : hint_of_units(a, thing));
}

void warn(World &w, const Overlap &o, bool untangled) {
  const Obstacle *const thing = o.obstacle ? w.obstacle(o.b) : nullptr;
  const std::string &name = thing ? thing->name : w.body(o.b)->name;
  w.context->warn(
      *w.body(o.a),
      " and %s '%s' overlap by %.3g m (%u pairs of triangles cross, %u surface points inside): %s",
      !thing                  ? "body"
      : !thing->rigid         ? "obstacle"
      : thing->rigid->of_tool ? "tool"
                              : "rigid body",
      name.c_str(), o.depth, o.crossings, o.enclosed, remedy(w, o, untangled).c_str());
}

// Parts that came off with the teeth of their faces in each other. Nobody has put them there, and contact
// leads them apart, so one sentence for all parts of a body is enough, until they are much deeper.
void warn_of_parts(World &w, const std::vector<Overlap> &found) {
  std::vector<uint64_t> wholes;
  for (const Overlap &o : found)
    if (o.whole && std::find(wholes.begin(), wholes.end(), o.whole) == wholes.end())
      wholes.push_back(o.whole);
  for (const uint64_t whole : wholes) {
    const Overlap *deepest = nullptr;
    size_t n = 0;
    for (const Overlap &o : found) {
      if (o.whole != whole) continue;
      ++n;
      if (!deepest || o.depth > deepest->depth) deepest = &o;
    }
    auto &reported = w.overlaps.reported_depths;
    auto at = std::find_if(reported.begin(), reported.end(), [&](const auto &t) { return t.first == whole; });
    if (at == reported.end()) at = reported.insert(at, {whole, 0.0});
    if (!(deepest->depth > kReportAgain * at->second)) continue;
    at->second = deepest->depth;
    const Body &a = *w.body(deepest->a), &b = *w.body(deepest->b);
    w.context->warn(
        "parts of body '%s' came off with their faces in each other, by up to %.3g m ('%s' and '%s'; %zu "
        "%s): teeth of a cut or tear are as large as the cells; contact moves them apart slowly, smaller "
        "cells or layers of cells along a cut make smaller teeth",
        made_name(a.piece_of ? a : b).c_str(), deepest->depth, a.name.c_str(), b.name.c_str(), n,
        n == 1 ? "pair" : "pairs");
  }
}

// It has separated: contact is on again.
void take_back(World &w, const Overlap &f) {
  if (std::erase_if(w.overlaps.suspended, [&](const SuspendedPair &p) {
        return p.a == f.a && p.b == f.b && (p.obstacle != 0) == f.obstacle;
      }))
    w.pairs.filter.set_aside(f.a, f.b, f.obstacle, false);
}

}  // namespace

void place_piece(World &w, uint64_t id) { w.overlaps.place(id | kPiece); }

void resolve_overlaps(World &w) {
  Overlaps &o = w.overlaps;
  if (!o.is_pending()) return;
  std::vector<Overlap> found = find_overlaps(w);
  const auto placed = [&](uint64_t id) {
    const auto has = [&](uint64_t x) { return std::binary_search(o.placed.begin(), o.placed.end(), x); };
    return has(id) || has(id | kPiece);
  };
  if (o.report_only) {
    for (Overlap &f : found) f.suspended = o.is_suspended(f.a, f.b, f.obstacle);
  } else {  // what is elsewhere now is judged anew
    std::erase_if(o.suspended, [&](const SuspendedPair &p) {
      if (!placed(p.a) && !placed(p.b)) return false;
      w.pairs.filter.set_aside(p.a, p.b, p.obstacle, false);
      return true;
    });
  }
  const bool untangles = w.def.flags & DFM_WORLD_UNTANGLE || o.untangle;
  if (untangles && !o.report_only) {
    // parts of one body are where contact has left them, and it goes on to move them apart
    const auto parts =
        std::stable_partition(found.begin(), found.end(), [](auto &f) { return f.whole == 0; });
    std::vector<Overlap> kept(parts, found.end());
    found.erase(parts, found.end());
    untangle(w, found);
    found.insert(found.end(), kept.begin(), kept.end());
  }
  std::vector<Overlap> left;
  for (const Overlap &f : found) {
    if (!f.separated) left.push_back(f);
    else take_back(w, f);
  }
  size_t n = 0;
  for (const Overlap &f : left)
    if (!f.whole && n++ < kSentences) warn(w, f, untangles);
  if (n > kSentences)
    w.context->warn("%zu more pairs overlap; dfm_world_overlaps lists them", n - kSentences);
  warn_of_parts(w, left);
  for (const Overlap &f : left) {
    if (!f.suspended || o.report_only || o.is_suspended(f.a, f.b, f.obstacle)) continue;
    o.suspended.push_back({f.a, f.b, f.obstacle});
    w.pairs.filter.set_aside(f.a, f.b, f.obstacle, true);
  }
  bool reported = left.empty();
  for (const Overlap &f : o.found) {  // those of an earlier search that no step has reported yet
    if (o.reported || o.all || f.separated || placed(f.a) || placed(f.b)) continue;
    found.push_back(f);
    reported = false;
  }
  o.found.assign(found.begin(), found.end());  // an interrupt gives back what was there, in this memory
  o.reported = reported;
  o.placed.clear();
  o.all = false;
}

void keep_suspended(World &w) {
  const auto gone = [&](const auto &p) {
    return !w.body(p.a) || (p.obstacle ? !w.obstacle(p.b) : !w.body(p.b));
  };
  std::erase_if(w.overlaps.suspended, gone);
  std::erase_if(w.overlaps.found, gone);
  for (const SuspendedPair &p : w.overlaps.suspended) w.pairs.filter.set_aside(p.a, p.b, p.obstacle, true);
}

void release_overlaps(World &w) {
  if (w.overlaps.suspended.empty() || w.step_count % kReleaseEvery != 0) return;
  OverlapSides sides(w);
  std::erase_if(w.overlaps.suspended, [&](const SuspendedPair &p) {
    const uint32_t j = p.obstacle ? w.obstacle(p.b)->slot : w.body(p.b)->slot;
    if (sides.look({w.body(p.a)->slot, j, p.obstacle != 0}, w.offset, true).through) return false;
    w.pairs.filter.set_aside(p.a, p.b, p.obstacle, false);
    return true;
  });
}

}  // namespace dfm
