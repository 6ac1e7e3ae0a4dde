// Cuts to come as a scene says them.
#include <algorithm>

#include "scene/write.h"

namespace dfm::writing {
namespace {

void write_place(const CutShape &s, Written &out) {
  dfm_pose pose{};
  store_pose(pose, {s.position, s.rotation});
  if (Written w = pose_of(pose); !w.is_null()) out["pose"] = std::move(w);
}

}  // namespace

void write_cuts(SceneWriter &to, const Body &b, Written &out) {
  for (const PlannedCut &c : b.planned_cuts) {
    const CutShape &s = c.shape;
    static const char *const words[] = {"ellipsoid", "box", "blade", "plane"};
    Written entry;
    entry["body"] = b.name;
    entry["t"] = std::max(c.t, to.w.time);
    entry["shape"] = words[size_t(s.kind)];
    switch (s.kind) {
      case CutKind::plane:
        entry["point"] = vector_of(s.corner[0]);
        entry["normal"] = vector_of(s.corner[1]);
        break;
      case CutKind::blade:
        for (const Vec3 &x : s.corner) entry["corners"].push_back(vector_of(x));
        break;
      case CutKind::ellipsoid:
      case CutKind::box: entry["half_size"] = vector_of(s.half_size); write_place(s, entry);
    }
    if (s.kind != CutKind::plane && s.kind != CutKind::blade && norm2(s.way) > 0)
      to.note(
          "body '%s': the shape of its cut at %g s has a motion; in the scene it stands where that begins",
          b.name.c_str(), c.t);
    entry["mode"] = c.how == DFM_CUT_SPLIT ? "split" : "remove";
    if (c.most > 0) entry["most"] = c.most;
    out.push_back(std::move(entry));
  }
}

}  // namespace dfm::writing
