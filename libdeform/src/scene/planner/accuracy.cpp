#include "scene/planner/accuracy.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "dynamics/symplectic_euler.h"

namespace dfm {
namespace {

constexpr double kPi = 3.14159265358979323846;
// Share of the proven step: 0.9 is used, and of that the next size below of four to the octave, in the mean
// over all sizes sum (1 - a/b) / ln 2 over the four pairs of neighbors a < b.
constexpr double kOffered = 0.9 * 0.9155;

double at_most(double x, double most) { return x < most ? x : most; }

// Between the two steps along a power law, beyond them as at the nearer one.
double ns_at(const CostAt &cost, double h) {
  if (!(cost.short_ns > 0)) return cost.ns;
  const double along = std::log(h / kCostStep) / std::log(kShortCostStep / kCostStep);
  return cost.ns * std::pow(cost.short_ns / cost.ns, std::clamp(along, 0.0, 1.0));
}

// Between measured sizes along a power law, beyond them along the last one; a body of more points is not
// cheaper as a whole.
double ns_per_point(const std::vector<CostAt> &costs, double points, double h) {
  if (costs.size() == 1) return ns_at(costs[0], h);
  size_t k = 1;
  while (k + 1 < costs.size() && costs[k].points < points) ++k;
  const CostAt &a = costs[k - 1], &b = costs[k];
  const double from = ns_at(a, h);
  const double slope = std::max(std::log(ns_at(b, h) / from) / std::log(b.points / a.points), -1.0);
  // below the smallest size the cost per point is constant, since small bodies fit the caches
  return from * std::pow(std::max(points, costs[0].points) / a.points, slope);
}

const MeasuredCells &cells_of(const MeasuredModel &m, const BodyRegime &b) {
  return b.hexahedra && m.hexahedra.any() ? m.hexahedra : m;
}

const std::vector<CostAt> &costs_of(const MeasuredModel &m, Scheme scheme, const BodyRegime &b) {
  return cells_of(m, b).costs[static_cast<size_t>(scheme)][static_cast<size_t>(what_it_meets(b))];
}

// The error of bending: along the power law through the two bars that were measured, by the angles that
// `estimate` gives for them.
double bending_error(const MeasuredModel &m, double rotation) {
  constexpr double kLittle = 4.0 / 3 * 0.02, kFar = 4.0 / 3 * 0.8;  // rad
  if (m.bends_little <= 0 || m.bends_far <= 0) return std::max(m.bends_little, m.bends_far);
  const double power = std::log(m.bends_far / m.bends_little) / std::log(kFar / kLittle);
  return m.bends_little * std::pow(std::max(rotation, 1e-6) / kLittle, std::max(power, 0.0));
}

// The model's error of the quantity. A force of contact has its own error where the body is dented, and that
// may be many times the force.
double model_error(const MeasuredModel &m, const BodyRegime &b, const Estimate &e, const Wish &wish) {
  double error = bending_error(m, e.rotation);
  if (b.touches && !b.held) error = std::max(error, m.lies);
  if (b.turns) error = std::max(error, m.turns);
  if (dented(b)) error = std::max(error, m.dents);
  error = at_most(wish.weight * at_most(error, 1), 1);
  return dented(b) && wish.force ? std::max(error, m.dent_force) : error;
}

// The error of a held body that a load bends at once. Cells that stiffen it by s let it sag by 1/(1+s) and
// swing sqrt(1+s) times as fast; without damping the difference in phase grows. Root mean square over the
// time.
double swing_error(const BodyRegime &b, const Estimate &e) {
  constexpr double kStep = 2 * kPi / 16;  // rad
  constexpr int kMin = 64, kMax = 4096;
  const int n = int(std::clamp(e.frequency * e.duration / kStep, double(kMin), double(kMax)));
  const auto place = [&](double times, double t) {
    const double w = e.frequency * std::sqrt(times),
                 rate = 0.5 * (b.damping_mass + b.damping_stiffness * w * w);
    // 1 - exp(-rate t) cos(w t), exact for short times
    const double half = std::sin(0.5 * w * t);
    return (2 * std::exp(-rate * t) * half * half - std::expm1(-rate * t)) / times;
  };
  double off = 0, all = 0;
  for (int i = 1; i <= n; ++i) {
    const double t = e.duration * i / n, exact = place(1, t), d = place(1 + stiffening(b), t) - exact;
    off += d * d;
    all += exact * exact;
  }
  return all > 0 ? std::sqrt(off / all) : 0;
}

// The factor of a free body is that of linear tetrahedra.
double mesh_error(const BodyRegime &b, const Estimate &e) {
  constexpr double kElse = 0.1;
  const double size = b.edge / b.thickness;
  return at_most(b.held ? swing_error(b, e) : kElse * size * size, 1);
}

// rad of the lowest mode that TR-BDF2 passes by backward Euler, because the body touches something. A held
// body that a probe presses longer than half a period follows the probe and no longer swings freely; so half
// a period counts for each new touch. A body whose own load presses it onto something bounces there as often
// as it swings.
double touched_turns(const BodyRegime &b, const Estimate &e) {
  const double turns = e.frequency * e.lasts;
  const bool bounces = b.below > 0 && b.below <= e.sag + b.depth;
  return !b.held || b.meets_body || bounces ? turns : std::min(turns, kPi * b.presses);
}

// The error of the scheme in the lowest mode until damping has ended it; the distance that a body moves
// between two detections; and the share of a rebound that backward Euler removes.
double time_error(Scheme scheme, bool steps_itself, double h, const BodyRegime &b, const Estimate &e) {
  const double wh = e.frequency * h, turns = e.frequency * e.lasts;
  double oscillation = 0;
  if (steps_itself && !b.touches) oscillation = 0;  // exact by mode
  else if (scheme == Scheme::explicit_euler && !steps_itself) oscillation = wh * wh / 24 * turns;
  else if (scheme == Scheme::tr_bdf2) {
    oscillation = 0.0404 * wh * wh * turns;  // Bank 1985
    if (b.touches) oscillation -= std::expm1(-0.5 * wh * touched_turns(b, e));
  } else oscillation = -std::expm1(-0.5 * wh * turns);  // backward Euler: the amplitude that it takes away
  const double scale = std::max({e.sag, b.travel, b.depth, 1e-12});
  const double share = e.sag / scale;  // of what moves, that oscillates
  const double event = b.touches ? std::max(b.speed, b.approach) * h / scale : 0;
  const bool damps = steps_itself || scheme != Scheme::explicit_euler;
  const double rebound = b.touches && !b.held && damps ? -std::expm1(-0.5 * kPi * wh) * b.after : 0;
  return at_most(std::max(share * at_most(oscillation, 1), rebound) + event, 1);
}

// s, by the stiffest mode, whose step without damping is h0 = 2/w. As in explicit bodies, dampers see the
// velocity or a lag of it, whichever allows more (doc/concepts/step.md). A uniform strain along a block has
// the frequency sqrt(12) c / L.
double explicit_step(const MeasuredModel &m, const BodyRegime &b) {
  const double nu = std::min(std::max(b.poisson, 0.0), 0.49);
  const double pressure = std::sqrt(b.young * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / b.density);
  const double h0 = cells_of(m, b).wave_steps * b.cell_size / pressure, w2 = 4 / (h0 * h0);
  const double beta = b.damping_stiffness;
  double h = stable_step(w2, b.damping_mass + beta * w2, 1);
  if (beta > 0) {
    const double lag = damper_lag(beta, std::sqrt(12 * b.young / b.density) / b.length);
    h = std::max(h, stable_step(w2 * (1 + beta / lag), b.damping_mass, 1));
  }
  return kOffered * h;
}

double cpu_per_s(const MeasuredModel &m, Scheme own, double h, const BodyRegime &b) {
  return 1e-9 * ns_per_point(costs_of(m, own, b), b.points, h) * b.points / h;
}

struct Try {
  const BodyRegime *body;
  Estimate e;
};

bool may(const BodyRegime &b, const MeasuredModel &m, Scheme scheme) {
  if (!b.model.empty() && b.model != m.id) return false;
  if (b.model.empty() && std::find(b.models.begin(), b.models.end(), m.id) == b.models.end()) return false;
  if (m.steps_itself) return !costs_of(m, Scheme::explicit_euler, b).empty();
  if (b.scheme >= 0 && static_cast<Scheme>(b.scheme) != scheme) return false;
  return !costs_of(m, scheme, b).empty();
}

BodyWay way_of(const MeasuredModel &m, Scheme scheme, double h, const Try &t, const Wish &wish) {
  const Scheme own = m.steps_itself ? Scheme::explicit_euler : scheme;
  BodyWay w;
  w.model = m.id;
  w.scheme = own;
  w.model_error = model_error(m, *t.body, t.e, wish);
  w.time_error = at_most(wish.weight * time_error(own, m.steps_itself, h, *t.body, t.e), 1);
  w.mesh_error = at_most(wish.weight * mesh_error(*t.body, t.e), 1);
  w.cpu_s_per_s = cpu_per_s(m, own, h, *t.body);
  return w;
}

double sum(const BodyWay &w) { return w.model_error + w.time_error; }
double whole(const BodyWay &w) { return sum(w) + w.mesh_error; }

// The errors of model and time that a choice may have: what the mesh leaves of the target. Where the mesh has
// more than half of it, as much as the mesh: less would cost much and change the sum little.
bool within(const BodyWay &w, double target) {
  return sum(w) <= std::max(target - w.mesh_error, std::min(w.mesh_error, target));
}

// Smaller is better. With a target: choices that meet it are ordered by cost, the others by error. With a
// budget the other way round.
bool better(const BodyWay &a, const BodyWay &b, const Wish &wish, double budget) {
  const bool errs = wish.target > 0;
  const bool am = errs ? within(a, wish.target) : a.cpu_s_per_s <= budget;
  const bool bm = errs ? within(b, wish.target) : b.cpu_s_per_s <= budget;
  if (am != bm) return am;
  return am == errs ? a.cpu_s_per_s < b.cpu_s_per_s : sum(a) < sum(b);
}

class Planner {
 public:
  Planner(const std::vector<BodyRegime> &bodies, const Measured &measured, const Wish &wish)
      : measured_(measured), wish_(wish) {
    for (const BodyRegime &b : bodies) tries_.push_back({&b, estimate(b, wish.duration)});
  }

  PlannedWay run() {
    for (size_t s = 0; s < kSchemes; ++s) {
      const Scheme scheme = static_cast<Scheme>(s);
      if (scheme == Scheme::explicit_euler) try_scheme(scheme, wish_.step);
      else if (wish_.step > 0) try_scheme(scheme, wish_.step);
      else
        for (int k = 0; k < kSteps; ++k) try_scheme(scheme, kFrame / (1 << k));
    }
    std::sort(out_.considered.begin(), out_.considered.end(),
              [](const Way &a, const Way &b) { return a.cpu_s_per_s < b.cpu_s_per_s; });
    for (const Way &w : out_.considered) {
      const bool first = !out_.found;
      out_.found = true;
      if (first || wins(w, out_.way)) out_.way = w;
    }
    if (out_.found && wish_.target > 0 && !met(out_.way)) take_whole_target();
    // skip choices that cost more than another without a smaller error
    double least = 2;
    std::erase_if(out_.considered, [&](const Way &w) {
      const bool behind = reach(w) >= least;
      least = std::min(least, reach(w));
      return behind;
    });
    if (out_.found) out_.meets = wish_.target > 0 ? met(out_.way) : meets(out_.way);
    say();
    if (out_.found && !out_.meets) out_.missed = wish_.target > 0 ? target_missed() : budget_missed();
    return out_;
  }

 private:
  // Implicit steps from 1/60 s down by halves, to 33 us: so short ones may cost less than explicit time.
  static constexpr int kSteps = 10;
  // A target that is missed by less than the digits of a prediction is met.
  static constexpr double kAsPrinted = 1.005;
  // A mesh whose error is half of the target instead of all of it has 2^1.5 as many cells, and costs 4 times
  // as much by explicit time.
  static constexpr double kFinerMesh = 4;

  bool met(const Way &w) const { return whole(worst(w).first) <= kAsPrinted * wish_.target; }

  // The cheapest choice that meets the target together with the mesh, if it costs no more than a finer mesh;
  // else it is named.
  void take_whole_target() {
    for (const Way &w : out_.considered) {
      if (!met(w)) continue;
      if (w.cpu_s_per_s <= (1 + 1e-9) * kFinerMesh * out_.way.cpu_s_per_s) out_.way = w;
      else
        dearer_ = format(" or %s%s, at %.3g s of processor per second", scheme_name(w.bodies[0].scheme),
                         w.step > 0 ? format(" with a time.step of %.3g ms", 1e3 * w.step).c_str() : "",
                         w.cpu_s_per_s);
      return;
    }
  }

  double reach(const Way &w) const {
    double most = 0;
    for (const BodyWay &b : w.bodies) most = std::max(most, sum(b));
    return most;
  }
  bool meets(const Way &w) const {
    if (!(wish_.target > 0)) return ms_per_step(w) <= wish_.ms_per_step;
    return std::all_of(w.bodies.begin(), w.bodies.end(),
                       [&](const BodyWay &b) { return within(b, wish_.target); });
  }
  bool wins(const Way &a, const Way &b) const {
    const bool am = meets(a), bm = meets(b);
    if (am != bm) return am;
    return am == (wish_.target > 0) ? a.cpu_s_per_s < b.cpu_s_per_s : reach(a) < reach(b);
  }

  // step 0: as long as explicit time allows
  void try_scheme(Scheme scheme, double step) {
    std::vector<const MeasuredModel *> models;
    double h = step > 0 ? step : kFrame;
    const double budget = wish_.ms_per_step * 1e-3 / frame() / tries_.size();
    bool bounded = false;
    for (const Try &t : tries_) {
      const MeasuredModel *best = nullptr;
      BodyWay best_way;
      for (const MeasuredModel &m : measured_.models) {
        if (!may(*t.body, m, scheme)) continue;
        const bool explicit_time = scheme == Scheme::explicit_euler && !m.steps_itself;
        const double own = explicit_time ? std::min(h_of(step), explicit_step(m, *t.body)) : h_of(step);
        const BodyWay way = way_of(m, scheme, own, t, wish_);
        if (!best || better(way, best_way, wish_, budget)) {
          best = &m;
          best_way = way;
        }
      }
      if (!best) return;
      models.push_back(best);
      if (scheme == Scheme::explicit_euler && !best->steps_itself) {
        h = std::min(h, explicit_step(*best, *t.body));
        bounded = true;
      }
    }
    const bool used = std::any_of(models.begin(), models.end(), [](auto *m) { return !m->steps_itself; });
    if (!used && scheme == Scheme::tr_bdf2) return;  // the same as with implicit_euler: all step themselves
    Way way;
    way.step = scheme == Scheme::explicit_euler && bounded ? step : h_of(step);
    way.frame = frame();
    // sub-steps are equal parts of the step
    way.substep = step > 0 ? step / std::ceil(step / h - 1e-9) : h;
    for (size_t i = 0; i < tries_.size(); ++i) {
      way.bodies.push_back(way_of(*models[i], scheme, way.substep, tries_[i], wish_));
      const BodyWay &b = way.bodies.back();
      way.error = std::max({way.error, at_most(sum(b) + b.mesh_error, 1), b.model_error});
      way.cpu_s_per_s += b.cpu_s_per_s;
    }
    out_.considered.push_back(way);
  }
  double frame() const { return h_of(wish_.step); }
  static double h_of(double step) { return step > 0 ? step : kFrame; }

  void say() {
    for (size_t i = 0; i < tries_.size(); ++i) {
      const BodyRegime &b = *tries_[i].body;
      const Estimate &e = tries_[i].e;
      out_.assumed.push_back(format(
          "body '%s': %u points, %.2g cells across its thinnest side; load %.3g m/s2 and speed %.3g m/s make "
          "a strain of about %.2g and turn parts by %.2g rad; lowest mode at %.3g Hz%s, which lasts %.3g "
          "s%s%s",
          b.name.c_str(), b.points, b.thickness / b.edge, b.load, b.speed, e.strain, e.rotation,
          e.frequency / (2 * kPi), b.held ? on_mesh(b, e).c_str() : "", e.lasts, b.held ? "; held" : "; free",
          b.touches ? ", may touch something" : ", touches nothing"));
      if (dented(b)) out_.assumed.push_back(dent(b));
      const double mesh = mesh_error(b, e) * wish_.weight;
      if (wish_.target > 0 && mesh > wish_.target)
        out_.assumed.push_back(
            format("body '%s': its mesh alone makes an error of about %.3g %%, which no model "
                   "and no step makes less",
                   b.name.c_str(), 100 * mesh));
    }
  }

  // The lowest mode of the bar with these cells, which is that of a model on this mesh.
  static std::string on_mesh(const BodyRegime &b, const Estimate &e) {
    return format(" (%.3g Hz on this mesh)", std::sqrt(1 + stiffening(b)) * e.frequency / (2 * kPi));
  }

  // The body with the largest error, and its number.
  static std::pair<BodyWay, size_t> worst(const Way &w) {
    size_t most = 0;
    for (size_t i = 1; i < w.bodies.size(); ++i)
      if (whole(w.bodies[i]) > whole(w.bodies[most])) most = i;
    return {w.bodies[most], most};
  }

  static std::string joined(const std::vector<std::string> &parts, const char *last) {
    std::string out;
    for (size_t i = 0; i < parts.size(); ++i)
      out += (i == 0 ? "" : i + 1 == parts.size() ? last : ", ") + parts[i];
    return out;
  }

  // The least number whose error is allowed, in steps of 5 %: where phases differ it does not go with a power
  // of the edge. First-order tetrahedra are too stiff against bending, hexahedra are not.
  std::string more_cells(BodyRegime b, const Estimate &e, double allowed) const {
    constexpr double kStep = 1.05, kMax = 1e9;
    const bool locks = b.held && b.stiffens > kBendingOfHexahedra;
    double times = 1;
    while (times < kMax && wish_.weight * mesh_error(b, e) > allowed) {
      times *= kStep;
      b.edge /= std::cbrt(kStep);
    }
    return format("about %.2g times as many cells%s", times,
                  locks ? ", or few hexahedra (\"lattice\", bricks)" : "");
  }

  std::string target_missed() const {
    const auto [w, i] = worst(out_.way);
    const BodyRegime &b = *tries_[i].body;
    const double target = wish_.target;
    std::vector<std::string> needs;
    if (w.model_error > 0.5 * target)
      needs.push_back(b.model.empty() ? "a model with smaller measured errors"
                                      : "another model (leave model.type out and the planner chooses)");
    const bool named = wish_.step > 0 || b.scheme >= 0;
    if (w.time_error > 0.5 * target && named)
      needs.push_back("other steps (leave time.step and time.integrator out and the planner chooses)");
    else if (w.time_error > 0.5 * target && !within(w, target))
      needs.push_back(
          format("a time.step of at most %.2g ms", 1e3 * out_.way.substep * 0.5 * target / w.time_error));
    // then a half is left to model and time
    if (w.mesh_error > 0.5 * target) needs.push_back(more_cells(b, tries_[i].e, 0.5 * target));
    if (needs.empty()) needs.push_back(named ? "a shorter time.step and a finer mesh" : "a finer mesh");
    return format(
        "the target of %.3g %% is not met: body '%s' has a predicted error of %.3g %% (model %.2g %%, "
        "time %.2g %%, mesh %.2g %%); to meet it takes %s%s, or a larger target",
        100 * target, b.name.c_str(), at_most(100 * whole(w), 100), 100 * w.model_error, 100 * w.time_error,
        100 * w.mesh_error, joined(needs, " and ").c_str(), dearer_.c_str());
  }

  std::string budget_missed() const {
    constexpr double kFewPoints = 50;
    const Way &way = out_.way;
    double points = 0;
    bool named = false;
    for (const Try &t : tries_) {
      points += t.body->points;
      named = named || !t.body->model.empty() || t.body->scheme >= 0;
    }
    // More cells make explicit steps shorter too; those of other schemes cost at least as much as they have
    // points.
    const double per_step = wish_.ms_per_step / ms_per_step(way);
    const double share = way.step > 0 && wish_.step <= 0 ? per_step : std::pow(per_step, 0.75);
    std::vector<std::string> needs;
    if (named) needs.push_back("another model or integrator (leave model.type and time.integrator out)");
    if (share * points > kFewPoints * double(tries_.size()))
      needs.push_back(format("at most about %.2g times as many cells", share));
    needs.push_back("a larger budget");
    return format(
        "the budget of %.3g ms per %s is not met: the cheapest choice takes a predicted %.3g ms, with an "
        "error of %.3g %%; to meet it takes %s",
        wish_.ms_per_step, wish_.step > 0 ? "step" : "1/60 s", ms_per_step(way),
        at_most(100 * way.error, 100), joined(needs, " or ").c_str());
  }

  // What each model that may be chosen leaves out of a dent.
  std::string dent(const BodyRegime &b) const {
    std::string errors;
    for (const MeasuredModel &m : measured_.models) {
      const bool named = b.model == m.id;
      if (!named && (!b.model.empty() || std::find(b.models.begin(), b.models.end(), m.id) == b.models.end()))
        continue;
      errors += format("%s%s %.3g %% (places %.3g %%)", errors.empty() ? "" : ", ", m.id.c_str(),
                       100 * m.dent_force, 100 * m.dents);
    }
    return format(
        "body '%s': %s touches it over about %.2g m, less than its thickness of %.2g m, and dents "
        "it; relative errors of the force of such a contact, measured on one dent: %s%s",
        b.name.c_str(), b.met.c_str(), b.contact, b.thickness, errors.c_str(),
        wish_.force ? "" : "; of these only the error of places counts for the quantity that is asked for");
  }

  const Measured &measured_;
  Wish wish_;
  std::vector<Try> tries_;
  std::string dearer_;  // a choice that meets the target and costs more than a finer mesh
  PlannedWay out_;
};

}  // namespace

const char *scheme_name(Scheme scheme) {
  constexpr const char *kNames[kSchemes] = {"symplectic_euler", "implicit_euler", "tr_bdf2"};
  return kNames[static_cast<size_t>(scheme)];
}

const char *meets_name(Meets meets) {
  constexpr const char *kNames[kMeets] = {"free", "touching", "pressed", "stacked"};
  return kNames[static_cast<size_t>(meets)];
}

double stiffening(const BodyRegime &b) {
  const double size = b.edge / b.thickness;
  return b.stiffens * size * size;
}

bool dented(const BodyRegime &b) { return b.touches && b.contact < b.thickness; }

bool mesh_error_known(const BodyRegime &b) { return b.held && !dented(b); }

Meets what_it_meets(const BodyRegime &b) {
  if (!b.touches) return Meets::nothing;
  if (b.meets_body) return Meets::body;
  return b.held ? Meets::probe : Meets::ground;
}

// A beam of the body's box. Held: a cantilever (Euler, Bernoulli; first root 1.875); free: both ends free
// (4.730); a block that is as long as thick moves along its length (pi c / L, or half of it where held).
Estimate estimate(const BodyRegime &b, double duration) {
  Estimate e;
  const double c = std::sqrt(b.young / b.density);  // m/s, of waves
  const double slender = b.length / b.thickness, gyration = b.thickness / std::sqrt(12.0);
  const double root = b.held ? 1.875 : 4.730;
  const double bending = root * root * gyration * c / (b.length * b.length);
  const double along = (b.held ? 0.5 : 1.0) * kPi * c / b.length;
  e.frequency = std::min(bending, along);
  const double rate = 0.5 * (b.damping_mass + b.damping_stiffness * e.frequency * e.frequency);
  const double weight = b.load * b.length / (c * c);  // rho a L / E
  double deflection = 0;                              // over the length
  if (b.held) {
    // a load that is applied at once overshoots the rest position
    const double swing = 1 + std::exp(-kPi * at_most(rate / e.frequency, 10));
    deflection = at_most(swing * 1.5 * weight * slender * slender, 1);
    e.strain = at_most(swing * std::max(weight, 3 * weight * slender), 1);
  } else if (b.touches) {
    e.strain = at_most(weight, 1);
    deflection = 0.5 * e.strain;
  }
  const double impact = b.touches ? b.speed / c : 0;
  e.strain = at_most(std::max(e.strain, impact), 1);
  e.rotation = at_most(std::max(b.held ? 4.0 / 3 * deflection : e.strain, impact), kPi / 2);
  e.sag = std::max(deflection, impact) * b.length;
  e.duration = duration;
  e.lasts = rate > 0 ? std::min(duration, 3 / rate) : duration;
  return e;
}

double predicted_cost(const Measured &measured, const std::string &model, const BodyRegime &body,
                      double step) {
  for (const MeasuredModel &m : measured.models) {
    if (m.id != model) continue;
    const Scheme scheme =
        m.steps_itself || body.scheme < 0 ? Scheme::explicit_euler : static_cast<Scheme>(body.scheme);
    if (costs_of(m, scheme, body).empty()) break;
    const bool divided = scheme == Scheme::explicit_euler && !m.steps_itself;
    return cpu_per_s(m, scheme, divided ? std::min(step, explicit_step(m, body)) : step, body);
  }
  return HUGE_VAL;
}

double ms_per_step(const Way &way) { return 1e3 * way.cpu_s_per_s * way.frame; }

PlannedWay plan_accuracy(const std::vector<BodyRegime> &bodies, const Measured &measured, const Wish &wish) {
  return Planner(bodies, measured, wish).run();
}

bool wins(const PlannedWay &a, const PlannedWay &b, const Wish &wish) {
  if (a.found != b.found) return a.found;
  if (a.meets != b.meets) return a.meets;
  return a.meets == (wish.target > 0) ? a.way.cpu_s_per_s < b.way.cpu_s_per_s : a.way.error < b.way.error;
}

}  // namespace dfm
