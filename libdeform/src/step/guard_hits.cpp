// Hits of the guard as contacts: linearized at their hit times, so that the straight motion that the solve
// sees ends outside.
#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "body/obstacle_mesh.h"
#include "ccd/toi_guard_motion.h"
#include "dynamics/rigid/rigid_set.h"
#include "math/turn.h"
#include "narrow/detail.h"
#include "narrow/parts.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/guard.h"
#include "step/rigid/rigid.h"
#include "step/self_contact.h"
#include "step/sides.h"
#include "step/solve/pre_solve.h"

namespace dfm {
namespace {

constexpr uint32_t kMaxHits = 128;

// Makes a contact from a hit: features, places and normal at the hit time. Returns the distance of the two
// places along that normal at the start, to which the straight motion is added.
class HitContact {
 public:
  HitContact(World &w, StepContext &step, const GuardHit &hit)
      : w_(w),
        step_(step),
        hit_(hit),
        c_((*step.guard.list)[hit.candidate]),
        end_(c_.obstacle ? step.guard.scene.poses[c_.slot_b] : GuardPose{}) {}

  bool make(ContactPoint &out, double &along) {
    out = {};
    out.slot_a = c_.slot_a;
    out.slot_b = c_.slot_b;
    out.feature_a = c_.feature_a;
    out.feature_b = c_.feature_b;
    out.obstacle = c_.obstacle;
    out.distance = hit_.start;
    out.kind = c_.obstacle ? uint8_t{kPrimitive} : c_.kind;
    if (step_.guard.scene.closed_form(c_)) on_shape(out);
    else on_surfaces(out);
    const double length = norm(now_);
    if (!(length > 0)) return false;
    const Vec3 n = (1 / length) * now_;
    store3(out.normal, n);
    store3(out.point, middle_);
    if (c_.obstacle) {
      const Vec3 belt = step_.obstacle_views[c_.slot_b].belt;
      store3(out.velocity, obstacle_way_ + belt - dot(belt, n) * n);
    }
    along = dot(n, start_);
    return true;
  }

 private:
  // The part of its displacement that is not its velocity: its faces turn, and it is set back elsewhere.
  Vec3 set_back(const GuardSide &side, uint32_t surfel, Vec3 way) const {
    if (side.still || !(side.surface->back > 0)) return {};
    side.surface->each_phyxel(surfel, [&](uint32_t p, double weight) {
      way -= weight * step_.h * load3(&side.mean[4 * size_t{p}]);
    });
    return way;
  }
  // Adds weight times a surfel to one side. A mesh without dofs has no nodes.
  void add(ContactPoint &out, bool b, uint32_t surfel, double weight) {
    GuardSide &side = step_.guard.scene.side(c_, b);
    const Vec3 x = load3(&side.surface->x[4 * size_t{surfel}]);
    const Vec3 end = load3(step_.guard.scene.end(side, surfel));
    if (!(b && c_.obstacle))
      narrow::add_node(out, step_.body_views[b ? c_.slot_b : c_.slot_a].first_node + surfel, weight);
    start_ += weight * (x + set_back(side, surfel, end - x));
    const Vec3 at = x + hit_.t * (end - x);
    now_ += weight * at;
    (b ? on_b_ : on_a_) += std::fabs(weight) * at;
    if (!b) return;
    from_b_ += std::fabs(weight) * x;
    to_b_ += std::fabs(weight) * end;
  }
  // The weight of corner k of a surfel, an edge or a triangle of one side.
  double weight_of(bool b, int kind, int k) const {
    if (kind != 1) return kind == 0 ? 1 : hit_.at[k];
    return k == 0 ? 1 - hit_.at[b] : hit_.at[b];
  }
  void add_feature(ContactPoint &out, bool b, int kind, uint32_t feature) {
    const uint32_t *const corner = narrow::corners_of(*step_.guard.scene.side(c_, b).surface, kind, feature);
    for (int k = 0; k <= kind; ++k) add(out, b, corner[k], (b ? -1 : 1) * weight_of(b, kind, k));
  }
  // m/s, of a point of the obstacle without contact, by the velocity of its body that the rows start from.
  // end: where it comes with the contact so far; that of what contact does not move.
  Vec3 way_of(Vec3 from, Vec3 end) const {
    const Obstacle &o = *w_.obstacles[c_.slot_b];
    if (is_moved(o)) {
      const double *const first = &o.rigid->first[6 * size_t{o.rigid_body}];
      const Vec3 center = step_.rigid_places[o.slot].center;
      end = center + step_.h * load3(first) + rotate(turned({}, step_.h * load3(first + 3)), from - center);
    }
    return (1 / step_.h) * (end - from);
  }
  void on_shape(ContactPoint &out) {
    const ObstacleView &v = step_.obstacle_views[c_.slot_b];
    out.type_a = c_.kind;
    add_feature(out, false, c_.kind, c_.feature_a);
    // The point of the shape at the hit: the nearest to the body's point at the hit time.
    ObstacleView at = v;
    at.position = v.position + hit_.t * (end_.position - v.position);
    at.rotation = slerp(v.rotation, end_.rotation, hit_.t);
    const ObstaclePoint o = ObstacleShape(at).closest(on_a_);
    out.feature_b = c_.kind == 0 ? o.face : hit_.part;
    const Vec3 local = rotate_back(at.rotation, o.point - at.position);
    now_ = o.distance > 0 ? on_a_ - o.point : o.normal;
    middle_ = 0.5 * (on_a_ + o.point);
    const Vec3 from = v.position + rotate(v.rotation, local);
    start_ -= from;
    obstacle_way_ = way_of(from, end_.position + rotate(end_.rotation, local));
  }
  // A contact of two bodies, or of a body and a mesh, whose vertex may meet a face of the body.
  void on_surfaces(ContactPoint &out) {
    const uint8_t kind = c_.obstacle ? c_.kind : c_.kind == kEdgeEdge;
    out.type_a = kind;
    if (kind == 2) std::swap(out.feature_a, out.feature_b);
    add_feature(out, false, kind, out.feature_a);
    add_feature(out, true, 2 - kind, out.feature_b);
    middle_ = 0.5 * (on_a_ + on_b_);
    if (c_.obstacle) obstacle_way_ = way_of(from_b_, to_b_);
  }

  World &w_;
  StepContext &step_;
  const GuardHit &hit_;
  const Candidate &c_;
  const GuardPose end_;  // of the obstacle
  // differences of the sides (b from a); places; m/s
  Vec3 start_, now_, on_a_, on_b_, middle_, from_b_, to_b_, obstacle_way_;
};

bool same_features(const ContactPoint &l, const ContactPoint &r) {
  return l.slot_a == r.slot_a && l.slot_b == r.slot_b && l.obstacle == r.obstacle && l.kind == r.kind &&
         l.type_a == r.type_a && l.feature_a == r.feature_a && l.feature_b == r.feature_b;
}

// The first key of these features that no contact has.
uint64_t free_key(const World &w, const StepContext &step, ContactPoint c) {
  const Surface *a = &w.bodies[c.slot_a]->surface, *b = nullptr;
  uint64_t id_a = w.bodies[c.slot_a]->id, id_b = id_of_b(w, c);
  if (!c.obstacle) {
    b = &w.bodies[c.slot_b]->surface;
  } else if (step.obstacle_views[c.slot_b].shape == Shape::mesh) {
    // named as contacts of two bodies (narrow/mesh_obstacle.cpp)
    b = &w.obstacles[c.slot_b]->mesh->surface;
    if (c.type_a == 2) {
      std::swap(a, b);
      std::swap(id_a, id_b);
      std::swap(c.feature_a, c.feature_b);
    }
    c.type_a = c.kind = c.type_a == 1 ? kEdgeEdge : kVertexFace;
    c.obstacle = 0;
  }
  const uint32_t patch = b ? narrow::patch_of(*b, c.kind, c.feature_b) : c.feature_b;
  for (uint32_t ordinal = 0;; ++ordinal) {
    const uint64_t key = narrow::contact_key(c, *a, id_a, b, id_b, patch, ordinal);
    if (std::none_of(step.contacts.begin(), step.contacts.end(),
                     [&](const ContactPoint &o) { return o.key == key; }))
      return key;
  }
}

// Keeps the earliest hit of each feature with each other side, and of those the earliest kMaxHits: an impact
// triggers all pairs around it, remaining hits are tested again, and a solve with thousands of nearly equal
// rows would not converge.
void choose_hits(StepContext &step) {
  Array<GuardHit> &hits = step.guard.hits;
  const Array<Candidate> &list = *step.guard.list;
  const auto side = [&](const GuardHit &h) {
    const Candidate &c = list[h.candidate];
    return std::array<uint32_t, 5>{c.slot_a, c.obstacle, c.slot_b, c.kind, c.feature_a};
  };
  const auto earlier = [](const GuardHit &l, const GuardHit &r) {
    return std::pair(l.t, std::pair(l.candidate, l.part)) < std::pair(r.t, std::pair(r.candidate, r.part));
  };
  std::sort(hits.begin(), hits.end(), [&](const GuardHit &l, const GuardHit &r) {
    const auto a = side(l), b = side(r);
    return a != b ? a < b : earlier(l, r);
  });
  hits.erase(std::unique(hits.begin(), hits.end(),
                         [&](const GuardHit &l, const GuardHit &r) { return side(l) == side(r); }),
             hits.end());
  std::sort(hits.begin(), hits.end(), earlier);
  if (hits.size() > kMaxHits) hits.resize(kMaxHits);
}

bool precedes(const Guard::Kept &l, const Guard::Kept &r) {
  return l.key != r.key ? l.key < r.key : l.more < r.more;
}

// kept: in order
const Guard::Kept *find_kept(const Array<Guard::Kept> &kept, const ContactPoint &c) {
  const auto k =
      std::lower_bound(kept.begin(), kept.end(), Guard::Kept{c.key, c.more, {}, 0, false}, precedes);
  return k == kept.end() || k->key != c.key || k->more != c.more ? nullptr : &*k;
}

// The rest distance of two bodies.
double rests_at(const World &w, const StepContext &step, const ContactPoint &c) {
  const BodyView &a = step.body_views[c.slot_a], &b = step.body_views[c.slot_b];
  if (!parts_of_one(*a.surface, a.id, *b.surface, b.id)) return w.offset;
  return rest_of_parts(*a.surface, *b.surface, c.kind, c.feature_a, c.feature_b, load3(c.normal), w.offset);
}

}  // namespace

void guard_filter_hits(World &w, StepContext &step) {
  if (!w.pre_solve.call) return;
  std::erase_if(step.guard.hits, [&](const GuardHit &hit) {
    ContactPoint c;
    double along;
    if (!HitContact(w, step, hit).make(c, along)) return false;
    for (const ContactPoint &o : step.contacts)
      if (same_features(o, c)) return false;
    c.key = free_key(w, step, c);
    return !query_host(w, step, c);
  });
}

// Adds hits to the contacts of the sub-step, in order. A contact that its pair has already gets the geometry
// of the hit, once; a further hit adds a row to it: a face that turns about one place comes near at another,
// and a single row would be led to and fro. Rows of a contact begin with the same state of friction, and are
// one contact again after the sub-step (keep_contacts.cpp).
void guard_add_hits(World &w, StepContext &step) {
  Guard &g = step.guard;
  choose_hits(step);
  const auto kept = [&](const ContactPoint &c) {
    return std::find_if(g.kept.begin(), g.kept.end(),
                        [&](const Guard::Kept &k) { return k.key == c.key && k.more == c.more; });
  };
  g.kept_before.swap(g.kept);
  g.kept.clear();
  for (uint32_t i = 0; i < step.rows.soft(); ++i) {
    const ContactPoint &c = step.contacts[i];
    const Guard::Kept *const k = find_kept(g.kept_before, c);
    g.kept.push_back({c.key, c.more, step.rows.world_impulse(i), step.rows.rate[i], k && k->hit});
  }
  for (const GuardHit &hit : g.hits) {
    ContactPoint c;
    double along;
    if (!HitContact(w, step, hit).make(c, along)) continue;
    // A pair that starts nearer than d_c comes no nearer; what it lacks to 0.8 d_c, and was not found with,
    // closes in the planned length of the sub-step.
    const Candidate &pair = (*g.list)[hit.candidate];
    const double apart = of_one_body(pair) ? guarded_apart(w, step, pair)
                         : pair.obstacle   ? w.offset
                                           : rests_at(w, step, c);
    const double found_with = start_depth(w, step, c, kNone, apart - hit.start);
    const double opens = std::max(0.0, 0.8 * apart - hit.start - found_with) * (step.h / step.length.planned);
    const double target = std::min(apart, std::min(hit.start, along) + opens);
    c.distance += w.offset - apart;
    const double rate = (along - target) / step.h;
    const auto same = std::find_if(step.contacts.begin(), step.contacts.end(),
                                   [&](const ContactPoint &o) { return same_features(o, c); });
    if (same == step.contacts.end()) {
      c.key = free_key(w, step, c);
    } else {
      c.key = same->key;
      if (const auto first = kept(*same); !first->hit) {
        c.area = same->area;
        c.area_node_plus_1 = same->area_node_plus_1;
        *same = c;
        first->rate = rate;
        first->hit = true;
        continue;
      }
      while (kept(c) != g.kept.end()) ++c.more;
    }
    step.contacts.push_back(c);
    g.kept.push_back({c.key, c.more, {}, rate, true});
  }
  std::sort(g.kept.begin(), g.kept.end(), precedes);
  const auto order = [&](const ContactPoint &c) {
    return std::tuple(c.more > 0, of_one_body(c), w.bodies[c.slot_a]->id, c.obstacle, id_of_b(w, c), c.kind,
                      c.type_a, c.feature_a, c.feature_b, c.key, c.more);
  };
  std::sort(step.contacts.begin(), step.contacts.end(),
            [&](const ContactPoint &l, const ContactPoint &r) { return order(l) < order(r); });
}

void guard_impulses(StepContext &step) {
  for (uint32_t i = 0; i < step.rows.soft(); ++i) {
    const Guard::Kept *const k = find_kept(step.guard.kept, step.contacts[i]);
    if (!k) continue;
    const Vec3 l = in_frame(&step.rows.frame[size_t(i) * 9], k->impulse);
    store3(&step.rows.impulse[size_t(i) * 3], {std::max(0.0, l.x), l.y, l.z});
  }
}

void guard_rates(StepContext &step) {
  for (uint32_t i = 0; i < step.rows.soft(); ++i)
    if (const Guard::Kept *const k = find_kept(step.guard.kept, step.contacts[i]); k && k->hit)
      step.rows.rate[i] = k->rate;
}

}  // namespace dfm
