#include "step/overlap/overlap.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/disjoint_sets.h"
#include "core/error.h"
#include "plugin/context.h"
#include "state/spring.h"
#include "state/world.h"
#include "step/overlap/overlap_sides.h"
#include "step/stages.h"
#include "step/watch/energy_watch.h"

namespace dfm {
namespace {

constexpr int kRounds = 64;      // over all pairs; a heap that is not apart by then has no room
constexpr int kRefinements = 6;  // halvings of the step with which the best direction is sought
// a body that is not convex may be free after a part of the way past the other's hull
constexpr int kParts = 16;
constexpr size_t kMaxTries = 96;  // at a pair, for such a part
constexpr double kConvex = 1.5;   // a way past the hull of up to this many depths is taken as it is
constexpr double kClear = 1.01;   // of d_c: contact starts without a load

struct Way {
  Vec3 direction;
  double length;
};

class Untangler {
 public:
  explicit Untangler(World &w)
      : w_(w), sides_(w), shift_(w.bodies.size()), groups_(w.memory(), uint32_t(w.bodies.size())) {
    for (auto &b : w.bodies) {
      // what it is attached to would draw it back to where it was
      const bool attached = std::any_of(w.attachments.begin(), w.attachments.end(), [&](const Attachment &x) {
        const bool has = x.body == b->id || (!x.obstacle && x.to == b->id);
        return !x.released && has && x.stiffness == 0 && x.damping == 0;
      });
      movable_.push_back(b->p.held_anywhere() == 0 && !attached && b->dynamics->abilities().placed);
    }
  }

  void run(std::vector<Overlap> &found) {
    std::vector<OverlapPair> pairs;
    for (const Overlap &f : found) pairs.push_back(pair_of(f));
    for (int round = 0; round < kRounds && !pairs.empty(); ++round) {
      bool any = false;
      for (const OverlapPair &p : pairs) any |= separate(p);
      if (!any) break;
      pairs = through();
    }
    // What goes back may find another body in its place: that one goes back too.
    for (; !pairs.empty(); pairs = through()) restore_positions(pairs);
    for (Overlap &f : found) {
      const OverlapPair p = pair_of(f);
      f.separated = moved(p) && !overlap(p);
      if (!f.separated) report_failure(p);
    }
    apply();
  }

 private:
  OverlapPair pair_of(const Overlap &f) const {
    return {slot_of(w_, f.a), f.obstacle ? obstacle_slot_of(w_, f.b) : slot_of(w_, f.b), f.obstacle};
  }
  bool moves(const OverlapPair &p) const { return movable_[p.a] || (!p.obstacle && movable_[p.b]); }
  bool moved(const OverlapPair &p) const {
    return norm2(shift_[p.a]) > 0 || (!p.obstacle && norm2(shift_[p.b]) > 0);
  }
  bool overlap(const OverlapPair &p) { return sides_.look(p, w_.offset, true).through; }

  // Pairs that overlap now and of which a side has moved.
  std::vector<OverlapPair> through() {
    std::vector<OverlapPair> out;
    for (uint32_t i = 0; i < w_.bodies.size(); ++i) {
      const bool whole = norm2(shift_[i]) > 0;
      for (uint32_t j = i + 1; j < w_.bodies.size(); ++j)
        if ((whole || norm2(shift_[j]) > 0) && sides_.may_touch({i, j, false}) && overlap({i, j, false}))
          out.push_back({i, j, false});
      for (uint32_t j = 0; j < w_.obstacles.size() && whole; ++j)
        if (sides_.may_touch({i, j, true}) && overlap({i, j, true})) out.push_back({i, j, true});
    }
    return out;
  }

  void shift(uint32_t i, Vec3 by) {
    if (norm2(by) == 0) return;
    shift_[i] += by;
    sides_.body(i).shift(by);
  }

  // Both go their share, by their masses, so that their common center stays; false: there is no way.
  bool separate(const OverlapPair &p) {
    if (!overlap(p)) return true;
    if (!moves(p)) return false;
    const Way way = find_way(p);
    if (!std::isfinite(way.length)) return false;
    double share = 1;  // of a
    if (!p.obstacle) {
      const double ma = w_.bodies[p.a]->mass, mb = w_.bodies[p.b]->mass;
      share = !movable_[p.a] ? 0 : !movable_[p.b] ? 1 : mb / (ma + mb);
      groups_.join(p.a, p.b);
    }
    shift(p.a, (share * way.length) * way.direction);
    if (!p.obstacle) shift(p.b, ((share - 1) * way.length) * way.direction);
    return true;
  }

  // How far a has to go along d until its hull has passed b's; negative: it has.
  double past(const OverlapPair &p, Vec3 d) {
    double lowest = std::numeric_limits<double>::infinity();
    const OverlapSkin &a = sides_.body(p.a);
    for (uint32_t s = 0; s < a.nsurfel(); ++s) lowest = std::min(lowest, dot(a.x(s), d));
    return sides_.reach(p, d) - lowest + clearance_;
  }

  Way find_way(const OverlapPair &p) {
    clearance_ = kClear * w_.offset + sides_.slack(p);
    std::vector<Way> ways;
    if (sides_.plane(p)) {
      const Vec3 n = sides_.shape(p).axis(2);
      ways.push_back({n, past(p, n)});
    } else {
      for (const Vec3 d : directions(p)) ways.push_back({d, past(p, d)});
      const auto shorter = [](const Way &l, const Way &r) { return l.length < r.length; };
      std::stable_sort(ways.begin(), ways.end(), shorter);
      ways.insert(ways.begin(), polished(p, ways.front()));
    }
    if (ways.front().length <= kConvex * sides_.look(p, w_.offset, false).depth + 2 * clearance_ &&
        clear(p, ways.front()))
      return ways.front();
    std::vector<Way> tries;
    for (const Way &way : ways)
      for (int k = 1; k <= kParts; ++k) tries.push_back({way.direction, way.length * k / kParts});
    std::stable_sort(tries.begin(), tries.end(),
                     [](const Way &l, const Way &r) { return l.length < r.length; });
    // Evenly over all lengths, if there are more than may be tested; the whole ways are among them.
    std::vector<Way> kept;
    for (size_t i = 0; i < tries.size(); i += tries.size() / kMaxTries + 1) kept.push_back(tries[i]);
    kept.push_back(ways.front());
    for (const Way &t : kept)
      if (clear(p, t)) return t;
    return {{}, std::numeric_limits<double>::infinity()};
  }

  bool clear(const OverlapPair &p, const Way &way) {
    const Vec3 by = way.length * way.direction;
    sides_.body(p.a).shift(by);
    const bool yes = !sides_.look(p, 0, true).through;
    sides_.body(p.a).shift(-by);
    return yes;
  }

  std::vector<Vec3> directions(const OverlapPair &p) {
    std::vector<Vec3> out;
    const OverlapSkin &a = sides_.body(p.a);
    const Vec3 between = 0.5 * (a.lo() + a.hi()) - sides_.center(p);
    if (norm2(between) > 0) {
      out.push_back(normalized(between));
      out.push_back(-normalized(between));
    }
    for (int k = 0; k < 27; ++k)
      if (k != 13) out.push_back(normalized({double(k / 9 - 1), double(k / 3 % 3 - 1), double(k % 3 - 1)}));
    if (p.obstacle)
      for (int k = 0; k < 3; ++k) {
        out.push_back(sides_.shape(p).axis(k));
        out.push_back(-sides_.shape(p).axis(k));
      }
    return out;
  }

  // A compass search on the sphere of directions.
  Way polished(const OverlapPair &p, Way best) {
    double step = 0.35;
    for (int k = 0; k < kRefinements; step *= 0.5, ++k) {
      const Vec3 t = any_tangent(best.direction), u = cross(best.direction, t);
      for (const Vec3 lean : {t, -t, u, -u}) {
        const Vec3 d = normalized(best.direction + step * lean);
        if (const double length = past(p, d); length < best.length) best = {d, length};
      }
    }
    return best;
  }

  // Whoever has had to do with what is not apart goes back to its place.
  void restore_positions(const std::vector<OverlapPair> &pairs) {
    std::vector<uint8_t> blocked(w_.bodies.size(), 0);
    for (const OverlapPair &p : pairs) {
      blocked[groups_.root(p.a)] = 1;
      if (!p.obstacle) blocked[groups_.root(p.b)] = 1;
    }
    for (uint32_t i = 0; i < w_.bodies.size(); ++i)
      if (blocked[groups_.root(i)]) {
        sides_.body(i).shift(-shift_[i]);
        shift_[i] = {};
      }
  }

  void report_failure(const OverlapPair &p) const {
    const std::string &b = p.obstacle ? w_.obstacles[p.b]->name : w_.bodies[p.b]->name;
    w_.context->warn("untangle cannot separate '%s' and '%s': %s", w_.bodies[p.a]->name.c_str(), b.c_str(),
                     moves(p) ? "it finds no free place for them, so they stay where they are"
                              : "neither may be moved as a whole, since points of them are held or attached, "
                                "or they step themselves");
  }

  double potential(const Body &b, Vec3 by) const {
    double joule = -b.mass * dot(w_.gravity.now, by);
    for (const Spring &s : b.springs) {
      const Vec3 pull = spring_force(b, s, w_.time, 0);
      joule += -dot(pull, by) + 0.5 * s.stiffness * norm2(by);
    }
    return joule;
  }

  void apply() {
    for (uint32_t i = 0; i < w_.bodies.size(); ++i) {
      const Vec3 by = shift_[i];
      if (norm2(by) == 0) continue;
      Body &b = *w_.bodies[i];
      w_.context->logf(DFM_LOG_INFO,
                       "untangle moved body '%s' by (%.4g, %.4g, %.4g) m; its energy in gravity and springs "
                       "changed by %.3g J",
                       b.name.c_str(), by.x, by.y, by.z, potential(b, by));
      for (uint32_t k = 0; k < b.p.n; ++k) add3(&b.p.x[size_t(k) * kStride], by);
      b.dynamics->points_changed();
      wake(w_, b);
      forget_energy(b);  // the change of potential is not counted as work
      ++w_.placements;
      ++b.x_version;
    }
  }

  World &w_;
  OverlapSides sides_;
  std::vector<uint8_t> movable_;
  std::vector<Vec3> shift_;
  DisjointSets groups_;  // bodies that have had to do with each other
  double clearance_ = 0;
};

}  // namespace

void untangle(World &w, std::vector<Overlap> &found) {
  if (!found.empty()) Untangler(w).run(found);
}

}  // namespace dfm
