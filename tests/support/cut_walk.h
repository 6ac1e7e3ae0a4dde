// Random cuts, told by a seed alone: bodies on a floor are cut by blades, ellipsoids, boxes and cell by cell,
// tear, come apart, step on, and are undone by snapshots, until nothing is left of them or the cuts asked for
// are made. What must hold is looked at after each of these.
#pragma once
#include <algorithm>
#include <sstream>

#include "cut_scenes.h"
#include "pile.h"

namespace test::cutting {

struct Walked {
  uint64_t cuts = 0;    // that opened a face or removed a cell
  uint64_t missed = 0;  // that met nothing
  uint64_t steps = 0, refused = 0, rolled_back = 0, tears = 0, pieces = 0, energy = 0;
  uint64_t contacts = 0;  // of all steps
  double speed = 0;       // m/s, the largest of any point that steps have given it, and not push()
  std::string failure;    // empty: all held
};

class CutWalk {
 public:
  // m/s: no step here gives a body such a speed, so the walk ends. push() does, where it meets a crumb.
  static constexpr double kFast = 100;
  static constexpr uint64_t kWork = 60000;  // units in a step: what is jammed is told of soon

  CutWalk(uint64_t seed, uint64_t cuts) : r_(seed), wanted_(cuts) {
    w_ = make_world(context_, {0, 0, -9.81});
    add_plane(w_, "floor");
    test::ok(dfm_world_set_budget(w_, 0, kWork));
    pile::law(w_, r_.below(2) ? "coulomb" : "lugre", r_);
    const uint32_t n = 1 + r_.below(2);
    for (uint32_t i = 0; i < n; ++i) make(i);
  }

  Walked run() {
    sum_ = sum();
    while (out_.failure.empty() && out_.speed < kFast && out_.cuts < wanted_ &&
           out_.missed < 50 + 4 * wanted_ && !bodies().empty()) {
      switch (r_.below(16)) {
        case 0:
        case 1:
        case 2: step(1 + r_.below(2)); break;
        case 3: keep(); break;
        case 4: undo(); break;
        case 5: push(); break;
        default: cut();
      }
    }
    return out_;
  }

 private:
  struct Sum { double mass = 0, momentum[3] = {}, speed = 0; };

  void make(uint32_t i) {
    const double side = r_.within(0.03, 0.07);
    const double tear = r_.within(0.1, 0.6), energy = r_.within(1, 100);
    dfm_material_def m = dfm_material_def_default();
    m.young = r_.scale(1e4, 1e5);
    m.poisson = r_.within(0.1, 0.4);
    m.damping_stiffness = r_.scale(1e-4, 1e-2);
    m.damping_mass = r_.within(0, 5);
    const dfm_param_value extra[] = {{"fracture_energy", &energy, 1}, {"tear", &tear, 1}};
    m.extra = {sizeof(dfm_params), 1 + r_.below(2), extra};
    dfm_material material = 0;
    test::ok(dfm_material_create(w_, &m, &material));
    const char *const kinds[] = {"beam", "ball", "cylinder"};
    const uint32_t kind = r_.below(3);
    const double sizes[3][3] = {{side, side * r_.within(0.5, 1), side * r_.within(0.5, 1)},
                                {0.5 * side, 0, 0},
                                {0.4 * side, side, 0}};
    dfm_mesh_handle mesh = 0;
    test::ok(dfm_mesh_make(context_, kinds[kind], sizes[kind], DFM_MESH_CELLS, 12 + r_.below(80), &mesh));
    dfm_body_def d = dfm_body_def_default();
    const std::string name = "body " + std::to_string(i);
    d.name = name.c_str();
    d.model = kModels[r_.below(2)];
    d.material = material;
    if (r_.below(4) == 0) d.integrator = DFM_INTEGRATOR_IMPLICIT_EULER;
    lend(mesh, d);
    d.pose.position[2] = 0.04 + 0.09 * i;
    d.pose.position[0] = r_.within(-0.02, 0.02);
    for (double &v : d.velocity) v = r_.within(-1, 1);
    for (double &v : d.spin) v = r_.within(-5, 5);
    dfm_body b = 0;
    test::ok(dfm_body_create(w_, &d, &b));
    test::ok(dfm_mesh_destroy(mesh));
    if (r_.below(2) == 0) return;
    dfm_separate_def rule = dfm_separate_def_default();
    rule.least_cells = 1 + r_.below(8);
    rule.crumbs = r_.below(2) ? DFM_CRUMBS_REMOVE : DFM_CRUMBS_STAY;
    test::ok(dfm_body_set_separate(b, &rule));
  }

  std::vector<dfm_body> bodies() const { return listed(dfm_world_bodies, w_); }
  Sum sum() const {
    Sum s;
    for (const dfm_body b : bodies()) {
      const dfm_body_measure m = measure(b);
      s.mass += m.mass;
      s.speed = std::max(s.speed, m.speed_max);
      for (int k = 0; k < 3; ++k) s.momentum[k] += m.momentum[k];
    }
    return s;
  }
  void fail(const std::string &what) {
    if (!out_.failure.empty()) return;
    std::ostringstream text;
    text << "cut " << out_.cuts << ", step " << out_.steps << ": " << what;
    out_.failure = text.str();
  }
  bool held(dfm_status s) {
    if (s == DFM_OK) return true;
    fail(dfm_last_error());
    return false;
  }

  // ---- what is done -------------------------------------------------------------------------------------

  void step(uint32_t n) {
    for (uint32_t i = 0; i < n && out_.failure.empty(); ++i) {
      uint32_t trouble = 0;
      const double mass = sum().mass;
      const dfm_status status = dfm_world_step(w_, 1e-3, &trouble);
      ++out_.steps;
      if (status == DFM_DISCARD ||
          status == DFM_E_DIVERGED) {  // in the last good state, from which a cut continues
        ++out_.refused;
        look();
        break;
      }
      if (!held(status)) return;
      out_.energy += (trouble & DFM_TROUBLE_ENERGY) != 0;
      if (trouble & (DFM_TROUBLE_NONFINITE | DFM_TROUBLE_PLUGIN)) fail("trouble " + std::to_string(trouble));
      bool crumbs = false;
      for (const dfm_contact_event &e : listed(dfm_world_events, w_)) {
        out_.tears += e.kind == DFM_EVENT_TEAR;
        out_.pieces += e.kind == DFM_EVENT_PIECE;
        crumbs = crumbs || e.kind == DFM_EVENT_TEAR;
      }
      const double now = sum().mass;
      if (std::fabs(now - mass) > 1e-12 * mass && !(crumbs && now < mass)) fail("a step changed the mass");
      out_.contacts += contacts(w_).size();
      look();
    }
    const double before = sum_.speed;
    sum_ = sum();
    if (sum_.speed > before) out_.speed = std::max(out_.speed, sum_.speed);
  }

  void keep() {
    kept_ = snapshot(w_);
    hash_ = dfm_world_hash(w_);
  }
  void undo() {
    if (kept_.empty()) return;
    if (!held(dfm_world_restore(w_, kept_.data(), kept_.size()))) return;
    if (dfm_world_hash(w_) != hash_) fail("a restored snapshot has another hash");
    ++out_.rolled_back;
    look();
    sum_ = sum();
  }

  // From any side, at up to some m/s; stretches bodies so that they tear.
  void push() {
    const std::vector<dfm_body> list = bodies();
    const dfm_body b = list[r_.below(uint32_t(list.size()))];
    const dfm_body_measure m = measure(b);
    double impulse[3];
    for (double &p : impulse) p = m.mass * r_.within(-0.5, 0.5);
    impulse[2] = std::fabs(impulse[2]);
    held(dfm_body_apply_impulse(b, m.com, impulse));
    // The impulse acts on few points, and may by itself make those of a crumb as fast as kFast.
    if (measure(b).speed_max > 0.3 * kFast) {
      for (double &p : impulse) p = -p;
      held(dfm_body_apply_impulse(b, m.com, impulse));
    }
    sum_ = sum();
  }

  void cut() {
    const std::vector<dfm_body> list = bodies();
    dfm_body b = list[r_.below(uint32_t(list.size()))];
    if (const dfm_body other = list[r_.below(uint32_t(list.size()))]; info(other).ntet > info(b).ntet)
      b = other;
    const State at(b);
    double lo[3], hi[3], middle[3], size = 0;
    for (size_t k = 0; k < 3; ++k) {
      lo[k] = HUGE_VAL;
      hi[k] = -HUGE_VAL;
      for (size_t i = k; i < at.x.size(); i += 3) {
        lo[k] = std::min(lo[k], at.x[i]);
        hi[k] = std::max(hi[k], at.x[i]);
      }
      middle[k] = r_.within(lo[k], hi[k]);
      size = std::max(size, hi[k] - lo[k]);
    }
    const uint32_t before = info(b).ntet;
    dfm_cut_info done = request();
    dfm_cut_def d = dfm_cut_def_default();
    switch (r_.below(8)) {
      case 0: {
        std::vector<uint32_t> cells(1 + r_.below(3));
        for (uint32_t &c : cells) c = r_.below(before);
        if (!held(dfm_body_remove_cells(b, uint32_t(cells.size()), cells.data(), &done))) return;
        return cut_made(b, before, done);
      }
      case 1:
        d.shape = r_.below(2) ? DFM_CUT_ELLIPSOID : DFM_CUT_BOX;
        for (size_t k = 0; k < 3; ++k) {
          d.pose.position[k] = middle[k];
          d.half_size[k] = size * r_.within(0.01, 0.2);
          d.motion[k] = r_.below(2) ? size * r_.within(-0.5, 0.5) : 0;
        }
        break;
      default: {
        d.shape = DFM_CUT_BLADE;
        d.how = r_.below(10) ? DFM_CUT_SPLIT : DFM_CUT_REMOVE;
        double u[3], v[3];
        const double long_by = size * r_.within(0.2, 3), wide = size * r_.within(0.2, 3);
        direction(u);
        direction(v);
        for (size_t k = 0; k < 3; ++k) {
          d.blade[k] = middle[k] - long_by * u[k] - wide * v[k];
          d.blade[3 + k] = middle[k] + long_by * u[k] - wide * v[k];
          d.blade[6 + k] = middle[k] + long_by * u[k] + wide * v[k];
          d.blade[9 + k] = middle[k] - long_by * u[k] + wide * v[k];
        }
      }
    }
    if (r_.below(4) == 0) d.most = 1 + r_.below(5);
    if (!held(dfm_body_cut(b, &d, &done))) return;
    cut_made(b, before, done);
    if (r_.below(12) == 0 && out_.failure.empty() && is_there(b)) {
      dfm_cut_info parted = request();
      if (!held(dfm_body_separate(b, nullptr, &parted))) return;
      out_.pieces += parted.pieces;
      expect_kept(parted);
    }
  }
  void direction(double out[3]) {
    double n = 0;
    do {
      n = 0;
      for (int k = 0; k < 3; ++k) {
        out[k] = r_.within(-1, 1);
        n += out[k] * out[k];
      }
    } while (n > 1 || n < 0.01);
    for (int k = 0; k < 3; ++k) out[k] /= std::sqrt(n);
  }

  // ---- what must hold -----------------------------------------------------------------------------------

  bool is_there(dfm_body b) const {
    const std::vector<dfm_body> list = bodies();
    return std::find(list.begin(), list.end(), b) != list.end();
  }

  void cut_made(dfm_body b, uint32_t before, const dfm_cut_info &done) {
    const bool met = done.cells > 0 || done.points > 0 || done.area > 0 || done.pieces > 0;
    ++(met ? out_.cuts : out_.missed);
    out_.pieces += done.pieces;
    if (done.cells > before) fail("more cells removed than there were");
    // signed by face, so it may be below zero where a rough blade's way meets few faces
    if (!std::isfinite(done.fracture)) fail("fracture energy");
    if (!(done.area >= 0) || !std::isfinite(done.area)) fail("area " + std::to_string(done.area));
    if (done.pieces == 0 && is_there(b) && info(b).ntet + done.cells != before) fail("cells do not add up");
    expect_kept(done);
  }

  // Over all bodies: the mass that was removed is the mass that the cut reports.
  void expect_kept(const dfm_cut_info &done) {
    const Sum now = sum();
    if (std::fabs(now.mass + done.mass - sum_.mass) > 1e-12 * sum_.mass) {
      std::ostringstream text;
      text << "mass " << sum_.mass << " became " << now.mass << ", told " << done.mass;
      fail(text.str());
    }
    for (int k = 0; k < 3; ++k) {
      const double scale = sum_.mass * std::max(1e-3, std::max(sum_.speed, now.speed));
      if (std::fabs(now.momentum[k] + done.momentum[k] - sum_.momentum[k]) > 1e-11 * scale) fail("momentum");
    }
    sum_ = now;
    look();
  }

  void look() {
    const std::vector<dfm_body> list = bodies();
    for (const dfm_body b : list) {
      const dfm_body_info i = info(b);
      if (i.ntet == 0 || !(i.mass > 0) || !(i.rest_volume > 0)) return fail("a body without cells or mass");
      const State s(b);
      for (const auto *values : {&s.x, &s.v})
        for (const double x : *values)
          if (!std::isfinite(x)) return fail("a value is not finite");
      std::vector<double> rest(3 * size_t{i.npoint});
      std::vector<uint32_t> tets(4 * size_t{i.ntet});
      test::ok(dfm_body_get_rest(b, i.npoint, rest.data(), i.ntet, tets.data()));
      for (size_t c = 0; c < i.ntet; ++c)
        if (!(volume(rest, &tets[4 * c]) > 0)) return fail("a cell without volume at rest");
    }
    for (const dfm_contact &c : contacts(w_)) {
      const auto counts = [&](uint64_t body, uint32_t feature, bool edge, bool triangle) {
        if (std::find(list.begin(), list.end(), body) == list.end()) return false;
        const dfm_body_info i = info(body);
        return feature < (triangle ? i.ntriangle : edge ? i.nedge : i.nsurfel);
      };
      const bool edges = c.kind == DFM_CONTACT_EDGE_EDGE;
      const bool a = counts(c.body_a, c.feature_a, edges || (c.flags & DFM_CONTACT_EDGE_A),
                            (c.flags & DFM_CONTACT_TRIANGLE_A) != 0);
      const bool b = c.body_b == 0 || c.kind == DFM_CONTACT_PRIMITIVE ||
                     counts(c.body_b, c.feature_b, edges, c.kind == DFM_CONTACT_VERTEX_FACE);
      if ((!a || !b) && (c.fn != 0 || c.ft[0] != 0)) return fail("a contact dangles");
    }
  }
  static double volume(const std::vector<double> &x, const uint32_t *t) {
    double e[3][3];
    for (size_t i = 0; i < 3; ++i)
      for (size_t k = 0; k < 3; ++k) e[i][k] = x[3 * size_t{t[i + 1]} + k] - x[3 * size_t{t[0]} + k];
    return (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
            e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
            e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
           6;
  }

  Context context_;
  dfm_world w_ = 0;
  pile::Random r_;
  uint64_t wanted_ = 0, hash_ = 0;
  std::string kept_;
  Sum sum_;
  Walked out_;
};

inline Walked walk_cuts(uint64_t seed, uint64_t cuts) { return CutWalk(seed, cuts).run(); }

}  // namespace test::cutting
