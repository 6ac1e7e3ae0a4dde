// A made-up island for ContactNewton: points that move by themselves, and a body whose equations of motion
// are A (v - free) = p with a full matrix. Contacts and bonds join them and places that do not move.
#pragma once
#include <gtest/gtest.h>

#include <memory>

#include "contact/newton.h"
#include "dense.h"
#include "near.h"
#include "same_tolerance.h"

namespace test {

using namespace dfm;

class LinearSystem final : public ImplicitSystem {
 public:
  // n points of a body of this mass, stiffer than their inertia by about `stiff`.
  LinearSystem(uint32_t n, double mass, double stiff, std::mt19937 &random)
      : a_(any_positive(3 * size_t{n}, random)), mass_(mass) {
    for (size_t k = 0; k < a_.rows; ++k)
      for (size_t c = 0; c < a_.columns; ++c) a_(k, c) = mass / n * (stiff * a_(k, c) + (k == c ? 1.0 : 0.0));
    for (uint32_t i = 0; i < n; ++i)
      for (uint32_t j = i; j < n; ++j) pairs_.insert(pairs_.end(), {i, j});
    places_.assign(4 * size_t{n}, 0.0);
    free_.assign(4 * size_t{n}, 0.0);
    inverse_.assign(4 * size_t{n}, 0.0);
    std::normal_distribution<double> speed;
    for (size_t k = 0; k < a_.rows; ++k) {
      free_[4 * (k / 3) + k % 3] = speed(random);
      inverse_[4 * (k / 3) + k % 3] = 1 / a_(k, k);
    }
  }
  BlockPattern pattern() const override {
    return {uint32_t(a_.rows / 3), uint32_t(pairs_.size() / 2), pairs_.data()};
  }
  double mass() const override { return mass_; }
  const double *start() const override { return free_.data(); }
  const double *places() const override { return places_.data(); }
  const double *diagonal_inverse() const override { return inverse_.data(); }
  bool residual(const double *v, double *r) override {
    for (size_t k = 0; k < a_.rows; ++k) {
      r[k] = 0;
      for (size_t c = 0; c < a_.columns; ++c)
        r[k] += a_(k, c) * (v[4 * (c / 3) + c % 3] - free_[4 * (c / 3) + c % 3]);
    }
    return true;
  }
  // Component c of point i moves as `speed` says, whatever acts on it.
  void fix(uint32_t i, uint32_t c, double speed = 0) {
    const size_t held = 3 * size_t{i} + c;
    for (size_t k = 0; k < a_.rows; ++k) a_(held, k) = a_(k, held) = k == held ? 1 : 0;
    free_[4 * size_t{i} + c] = speed;
    inverse_[4 * size_t{i} + c] = 0;
  }
  uint32_t assembled = 0;  // times
  bool matrix(const uint32_t *at, double *blk) override {
    ++assembled;
    for (size_t b = 0; b < pairs_.size() / 2; ++b)
      for (size_t k = 0; k < 9; ++k)
        blk[9 * size_t{at[b]} + k] += a_(3 * pairs_[2 * b] + k / 3, 3 * pairs_[2 * b + 1] + k % 3);
    return true;
  }
  void take(const double *v) override { found.assign(v, v + free_.size()); }

  std::vector<double> found;  // [n,4]

 private:
  Dense a_;
  double mass_;
  std::vector<uint32_t> pairs_;
  std::vector<double> places_, free_, inverse_;
};

// Coulomb's law at the trial of the state: the force that ends the slip, within mu times the normal force.
inline void coulomb(double mu, uint32_t i, ContactState &s) {
  const uint32_t second = s.stride + i;
  const double size = std::hypot(s.ft_stop[i], s.ft_stop[second]);
  s.form[i] = kSetValuedLaw;
  s.limit[i] = mu * s.fn[i];
  s.mode[i] = size > s.limit[i] ? 2 : 1;
  const double share = size > s.limit[i] ? s.limit[i] / size : 1;
  for (const uint32_t at : {i, second}) {
    s.ft[at] = share * s.ft_stop[at];
    s.dft_dfn[at] = s.mode[i] == 2 ? mu * s.ft_stop[at] / size : 0;
  }
}

// A bristle of stiffness sigma that begins the sub-step with stretch z and yields toward the limit R:
//
//     f(v) = -t R / (R + |t|),   t = sigma z + kappa v,   kappa = h sigma,   R = mu fn
//
// as LuGre's law with backward Euler.
struct BristleLaw {
  double sigma = 0, mu = 0, z1 = 0, z2 = 0;  // N/m, -, m

  // At the trial, where slip and force lie on the line v = w h (f - ft_stop): the share s = R / (R + |t|) is
  // the root of a monotone function.
  void evaluate_local(uint32_t i, double h, double w, ContactState &s) const {
    const uint32_t n = s.stride;
    const double kappa = h * sigma, R = mu * s.fn[i], g = w * h, z[2] = {z1, z2};
    double t[2], size = 0;
    const auto stretch = [&](double share) {
      for (uint32_t c = 0; c < 2; ++c)
        t[c] = (sigma * z[c] - g * kappa * s.ft_stop[c * n + i]) / (1 + g * kappa * share);
      size = std::hypot(t[0], t[1]);
    };
    double low = 0, high = 1;
    for (int k = 0; k < 100 && R > 0; ++k) {
      const double share = low > 1e-3 * high ? 0.5 * (low + high) : std::max(0.1 * high, 2 * low);
      stretch(share);
      (share * (R + size) < R ? low : high) = share;
    }
    const double share = R > 0 ? high : 0;
    stretch(share);
    s.form[i] = kSmoothLaw;
    s.limit[i] = R;
    s.mode[i] = 2;
    for (uint32_t c = 0; c < 2; ++c) {
      s.ft[c * n + i] = -t[c] * share;
      s.vt[c * n + i] = g * (s.ft[c * n + i] - s.ft_stop[c * n + i]);
      s.dft_dfn[c * n + i] = R > 0 ? -t[c] * mu * share * (1 - share) / R : 0;
    }
    for (uint32_t r = 0; r < 2; ++r)
      for (uint32_t c = 0; c < 2; ++c)
        s.dft_dvt[(2 * r + c) * n + i] =
            size > 0 && R > 0 ? kappa * share * (t[r] * share / R * (t[c] / size) - (r == c ? 1 : 0)) : 0;
  }
};

// Coulomb's law at each contact, or a bristle where its stiffness is given.
class Laws final : public SolveLaws {
 public:
  Laws(ContactRows &rows, const RowsPart &part, ContactState &state, double h, double least)
      : tolerance(rows.n, least, least, least), law(rows.n), rows_(rows), part_(part), state_(state), h_(h) {
    tolerance.bond = least;
    state.resize(rows.n, 0);
    std::fill(state.form.begin(), state.form.end(), uint8_t{kSetValuedLaw});
  }
  bool evaluate_local(const double *response, double) override {
    for (uint32_t i = 0; i < rows_.n; ++i)
      if (law[i].sigma > 0) law[i].evaluate_local(i, h_, response[i], state_);
      else coulomb(law[i].mu, i, state_);
    return true;
  }
  bool judge(Residual &residual) override {
    set_trial(rows_, part_, h_, rows_.wt.data(), state_);
    evaluate_local(rows_.wt.data(), 0);
    linearize(rows_, part_, h_, state_);
    residual = residual_of(rows_, part_, state_, h_, tolerance);
    return true;
  }
  void spend(uint64_t) override {}
  bool goes_on() override { return true; }
  void set(uint32_t i, const BristleLaw &of) {
    law[i] = of;
    state_.form[i] = of.sigma > 0 ? kSmoothLaw : kSetValuedLaw;
  }
  void set_all(const BristleLaw &of) {
    for (uint32_t i = 0; i < rows_.n; ++i) set(i, of);
  }

  SameTolerance tolerance;
  std::vector<BristleLaw> law;

 private:
  ContactRows &rows_;
  RowsPart part_;
  ContactState &state_;
  double h_;
};

class Island {
 public:
  static constexpr double kStep = 1e-3, kOffset = 1e-4, kTolerance = 1e-6;  // s, m, m/s
  ContactRows rows{Memory::standard()};
  ContactState state;
  std::vector<ContactPoint> contacts;
  std::vector<Bond> bonds;
  std::unique_ptr<LinearSystem> body;  // its points are nodes behind the single ones
  std::unique_ptr<Laws> laws;
  ContactNewton newton{Memory::standard()};

  // points: kg of each, and m/s
  Island(std::vector<double> mass, const std::vector<Vec3> &velocity, std::unique_ptr<LinearSystem> with = {})
      : body(std::move(with)), mass_(std::move(mass)) {
    const auto points = uint32_t(mass_.size());
    inverse_.resize(4 * mass_.size());
    velocity_.resize(4 * mass_.size());
    for (uint32_t k = 0; k < points; ++k) {
      points_.point.push_back(k);
      for (size_t c = 0; c < 3; ++c) inverse_[4 * k + c] = 1 / mass_[k];
      store3(&velocity_[4 * size_t{k}], velocity[k]);
    }
    const uint32_t more = body ? body->pattern().n : 0;
    for (uint32_t k = 0; k < more; ++k) body_.point.push_back(k);
    for (const auto &[surface, count] : {std::pair{&points_, points}, std::pair{&body_, more}}) {
      surface->nsurfel = count;
      surface->x.resize(4 * size_t{count});
      surface->v.resize(4 * size_t{count});
    }
  }
  // Nodes a with weights that sum to 1 against nodes b, or against what does not move.
  void touch(const std::vector<std::pair<uint32_t, double>> &nodes, bool obstacle, Vec3 normal,
             double gap = 0) {
    ContactPoint c{};
    c.key = contacts.size();
    c.nnode = uint8_t(nodes.size());
    for (size_t k = 0; k < nodes.size(); ++k) std::tie(c.node[k], c.weight[k]) = nodes[k];
    c.obstacle = obstacle;
    store3(c.normal, normalized(normal));
    c.distance = kOffset + gap;
    contacts.push_back(c);
  }
  void hold(uint32_t a, uint32_t b, double soft, Vec3 rate) { bonds.push_back(bond(a, b, soft, rate)); }
  void drag(uint32_t a, uint32_t b, Vec3 along, double most, double max_work) {
    Bond d = bond(a, b, 0, {});
    d.along = normalized(along);
    d.most = most;
    d.max_work = max_work;
    bonds.push_back(d);
  }
  // Once all rows are there.
  void build(const BristleLaw &law) {
    std::vector<DofSource> sources = {
        {0, points_.nsurfel, 0, points_.nsurfel, &points_, inverse_.data(), velocity_.data()}};
    if (body) {
      sources.push_back({points_.nsurfel, body_.nsurfel, points_.nsurfel, body_.nsurfel, &body_,
                         body->diagonal_inverse(), body->start()});
      sources.back().whole = 2.5 / body->mass();
    }
    rows.build(contacts, sources, {}, bonds);
    std::vector<double> tangents(3 * contacts.size());
    for (size_t i = 0; i < contacts.size(); ++i)
      store3(&tangents[3 * i], any_tangent(load3(contacts[i].normal)));
    rows.finish(contacts, tangents.data(), kStep, kStep, kOffset, bonds);
    rows.y_free.assign(rows.y.begin(), rows.y.end());
    rows.impulse.assign(rows.impulse.size(), 0.0);
    laws = std::make_unique<Laws>(rows, rows.whole(), state, kStep, kTolerance);
    laws->set_all(law);
  }
  bool solve(double tolerance = kTolerance) {
    ImplicitSystem *const systems[2] = {nullptr, body.get()};
    newton.begin(rows, rows.whole(), {systems, body ? 2u : 1u}, state, *laws, kStep);
    if (!newton.solve(tolerance, tolerance)) return false;
    newton.take();
    return true;
  }

  Vec3 velocity(uint32_t node) const {  // that the solve has found
    if (node >= points_.nsurfel) return load3(&body->found[4 * size_t{node - points_.nsurfel}]);
    for (uint32_t d = 0; d < rows.ndof; ++d)
      if (rows.source[d] == 0 && rows.point[d] == node) return load3(&rows.y[4 * size_t{d}]);
    return load3(&velocity_[4 * size_t{node}]);
  }
  Vec3 relative(uint32_t row) const {  // in the axes of the row
    Vec3 u;
    each_node(row, [&](uint32_t node, double weight) { u += weight * velocity(node); });
    return {dot(axis(row, 0), u), dot(axis(row, 1), u), dot(axis(row, 2), u)};
  }
  Vec3 impulse(uint32_t row) const { return load3(&rows.impulse[3 * size_t{row}]); }

  // m/s, the largest by which momentum of a point or of the body is not what impulses have made of it
  double unbalanced() const {
    std::vector<double> sum(3 * size_t{points_.nsurfel + body_.nsurfel});
    for (uint32_t i = 0; i < rows.all(); ++i) {
      const Vec3 l = impulse(i), p = l.x * axis(i, 0) + l.y * axis(i, 1) + l.z * axis(i, 2);
      each_node(i, [&](uint32_t node, double weight) {
        for (int c = 0; c < 3; ++c) sum[3 * node + size_t(c)] += weight * p[c];
      });
    }
    double most = 0;
    for (uint32_t k = 0; k < points_.nsurfel; ++k)
      for (int c = 0; c < 3; ++c)
        most = test::worse(most, std::fabs(velocity(k)[c] - velocity_[4 * size_t{k} + size_t(c)] -
                                           sum[3 * size_t{k} + size_t(c)] / mass_[k]));
    if (!body || body->found.empty()) return most;
    std::vector<double> r(3 * size_t{body_.nsurfel});
    body->residual(body->found.data(), r.data());
    for (size_t k = 0; k < r.size(); ++k)
      most = test::worse(most, std::fabs(r[k] - sum[3 * size_t{points_.nsurfel} + k]) *
                                   body->diagonal_inverse()[4 * (k / 3) + k % 3]);
    return most;
  }
  // Signorini's and Coulomb's conditions of every contact, and those of bonds, within the tolerance; slip may
  // be off by a thousandth of it (contact/solver.cpp).
  void expect_conditions(double tolerance = kTolerance) const {
    for (uint32_t i = 0; i < rows.n; ++i) {
      const Vec3 u = relative(i), l = impulse(i);
      const double mu = laws->law[i].mu, limit = mu * l.x, slip = std::hypot(u.y, u.z),
                   size = std::hypot(l.y, l.z), allowed = std::max(tolerance, 1e-3 * slip);
      EXPECT_GE(l.x, 0) << i;
      EXPECT_GE(u.x + rows.rate[i], -tolerance) << i;
      EXPECT_LE(std::min(rows.wn[i] * l.x, u.x + rows.rate[i]), tolerance) << i;
      if (laws->law[i].sigma > 0) continue;
      EXPECT_LE(size, limit * (1 + 1e-9)) << i;
      if (!(l.x > 0)) continue;
      // what is left of the disc is not used where there is slip, and friction is against it
      EXPECT_LE(std::min(rows.wt[i] * (limit - size), slip), allowed) << i;
      if (slip > 10 * allowed && rows.wt[i] * limit > 10 * allowed) {
        EXPECT_LE((l.y * u.y + l.z * u.z) / (slip * size), -0.9) << i;
      }
      EXPECT_LE(l.y * u.y + l.z * u.z, allowed * limit) << i;
    }
    for (uint32_t k = 0; k < rows.nbond; ++k) expect_bond(k, tolerance);
  }
  double work() const {  // J, of all contacts
    double sum = 0;
    for (uint32_t i = 0; i < rows.n; ++i) sum += dot(impulse(i), relative(i));
    return sum;
  }
  double effort() const {  // N s
    double sum = 0;
    for (uint32_t i = 0; i < rows.n; ++i) sum += norm(impulse(i));
    return sum;
  }

 private:
  std::vector<double> mass_;
  Array<double> inverse_, velocity_;
  Surface points_, body_;

  Bond bond(uint32_t a, uint32_t b, double soft, Vec3 rate) const {
    Bond out{};
    out.obstacle = b == kNone;
    out.nnode = b == kNone ? 1 : 2;
    out.node[0] = a;
    out.weight[0] = 1;
    if (b != kNone) {
      out.node[1] = b;
      out.weight[1] = -1;
    }
    out.rate = rate;
    out.soft = soft;
    return out;
  }
  Vec3 axis(uint32_t row, size_t k) const { return load3(&rows.frame[9 * size_t{row} + 3 * k]); }
  template <class F>
  void each_node(uint32_t row, F &&f) const {
    if (row < rows.n) {
      for (uint32_t k = 0; k < contacts[row].nnode; ++k) f(contacts[row].node[k], contacts[row].weight[k]);
      return;
    }
    const Bond &b = bonds[row - rows.n];
    for (uint32_t k = 0; k < b.nnode; ++k) f(b.node[k], b.weight[k]);
  }
  void expect_bond(uint32_t k, double tolerance) const {
    const Bond &b = bonds[k];
    const Vec3 u = relative(rows.n + k), l = impulse(rows.n + k);
    if (!b.drags()) {
      EXPECT_LE(norm(u + b.rate + b.soft * l), 2 * tolerance) << "bond " << k;
      return;
    }
    const double size = dot(b.along, l), speed = -dot(b.along, u);
    EXPECT_LE(norm(l - size * b.along), 1e-12 * (1 + norm(l))) << "drag " << k;
    EXPECT_GE(size, 0) << "drag " << k;
    EXPECT_LE(size, b.most * (1 + 1e-12)) << "drag " << k;
    EXPECT_GE(speed, size > 0 ? -tolerance : -1e300) << "drag " << k;
    EXPECT_LE(size * speed, b.max_work + tolerance * size) << "drag " << k;
    // an edge that moves is held by all that the drag has
    if (speed > tolerance && size < b.most * (1 - 1e-9)) {
      EXPECT_GE(size * speed, b.max_work - tolerance * (size + b.max_work)) << "drag " << k;
    }
  }
};

}  // namespace test
