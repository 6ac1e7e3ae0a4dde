// A problem of others: contacts of a body that steps itself, the response of which is W.
#include <algorithm>
#include <cmath>
#include <ctime>

#include "contact/newton.h"
#include "plane.h"
#include "solve.h"

namespace contact {

using namespace dfm;

namespace {

// The natural map of one contact: u with the term of its friction, r, mu.
double natural_map(Vec3 u, Vec3 r, double mu) {
  const Vec3 z = r - (u + Vec3{mu * cli::plane_length(u.y, u.z), 0, 0});
  const double size = cli::plane_length(z.y, z.z);
  Vec3 p = z;
  if (size > mu * z.x) {
    const double normal = (z.x + mu * size) / (1 + mu * mu);
    p = normal <= 0 ? Vec3{} : Vec3{normal, normal * mu * z.y / size, normal * mu * z.z / size};
  }
  return dot(r - p, r - p);
}

}  // namespace

double siconos_error(const LocalProblem &p, const std::vector<double> &u, const double *r) {
  double sum = 0, size = 0;
  for (size_t i = 0; i < p.mu.size(); ++i) sum += natural_map(load3(&u[3 * i]), load3(r + 3 * i), p.mu[i]);
  for (const double q : p.q) size += q * q;
  return std::sqrt(sum) / (size > 0 ? std::sqrt(size) : 1);
}

std::vector<double> velocities(const LocalProblem &p, const double *r) {
  std::vector<double> u = p.q;
  for (size_t k = 0; k < u.size(); ++k)
    for (size_t c = 0; c < u.size(); ++c) u[k] += p.W(k, c) * r[c];
  return u;
}

// By Cholesky's method that takes the largest diagonal next.
uint32_t rank_of(Matrix W) {
  const size_t n = W.rows;
  double top = 0;
  for (size_t k = 0; k < n; ++k) top = std::max(top, W(k, k));
  for (uint32_t rank = 0; rank < n; ++rank) {
    size_t pivot = 0;
    for (size_t k = 1; k < n; ++k)
      if (W(k, k) > W(pivot, pivot)) pivot = k;
    const double most = W(pivot, pivot);
    if (!(most > 1e-13 * top)) return rank;
    std::vector<double> column(n);
    for (size_t k = 0; k < n; ++k) column[k] = W(k, pivot);
    for (size_t r = 0; r < n; ++r) {
      if (column[r] == 0) continue;
      const double share = column[r] / most;
      for (size_t c = 0; c < n; ++c) W(r, c) -= share * column[c];
    }
  }
  return static_cast<uint32_t>(n);
}

namespace {

class Solve final : public SolveLaws {
 public:
  Solve(const LocalProblem &problem, Result &result)
      : problem_(problem), n_(uint32_t(problem.mu.size())), result_(result) {
    Surface surface;
    surface.nsurfel = n_;
    surface.x.assign(4 * size_t{n_}, 0.0);
    std::vector<ContactPoint> contacts(n_);
    std::vector<double> tangents(3 * size_t{n_}), free(4 * size_t{n_});
    for (uint32_t i = 0; i < n_; ++i) {
      surface.point.push_back(i);
      ContactPoint &c = contacts[i];
      c.obstacle = c.nnode = 1;
      c.node[0] = i;
      c.weight[0] = 1;
      c.normal[0] = 1;
      tangents[3 * size_t{i} + 1] = 1;
    }
    const DofSource source{0, n_, 0, n_, &surface, nullptr, free.data()};
    rows_.build(contacts, {&source, 1});
    set_response(0);
    rows_.finish(contacts, tangents.data(), kStep, kStep, 0);
    rows_.impulse.assign(3 * size_t{n_}, 0.0);
    rows_.y_free.assign(rows_.y.begin(), rows_.y.end());
    state_.resize(n_, 0);
    std::ranges::fill(state_.form, uint8_t{kSetValuedLaw});
    for (uint32_t i = 0; i < n_; ++i) {  // Coulomb's law: limits in proportion to the normal force
      state_.fn[i] = 1;
      state_.limit[i] = problem.mu[i];
      state_.mode[i] = 1;
    }
    for (const double q : problem.q) scale_ = std::max(scale_, std::fabs(q));
  }
  // Parts of W that are not symmetric, or that its factor leaves, go into q of the next run. So does a
  // share of its largest entry that is added to the diagonal where a run has found no solution: a W that
  // is assembled with errors has negative eigenvalues, and rows may contradict each other by as much.
  void run() {
    const uint32_t block = 0;
    ContactRows::Motions motions;
    rows_.motions({&block, 1}, motions);
    result_.rank = motions.rank;
    ImplicitSystem *const none = nullptr;
    std::vector<double> q = problem_.q;
    for (result_.runs = 0; result_.runs < kRuns;) {
      if (result_.runs++ > 0 && newton_.residual().required > 1) set_response(kAdded);
      for (size_t k = 0; k < q.size(); ++k)
        rows_.y_free[4 * (k / 3) + k % 3] = rows_.y[4 * (k / 3) + k % 3] = q[k];
      newton_.begin(rows_, rows_.whole(), {&none, 1}, state_, *this, kStep);
      if (!newton_.solve(kShare * scale_, kShare * scale_)) break;
      result_.passes += newton_.passes();
      result_.steps += newton_.steps();
      result_.products += newton_.products();
      result_.factors += newton_.factors();
      const std::vector<double> u = velocities(problem_, rows_.impulse.data());
      const double now = siconos_error(problem_, u, rows_.impulse.data());
      if (now < result_.error) {
        result_.error = now;
        result_.speed = 0;
        for (uint32_t i = 0; i < n_; ++i)
          result_.speed = std::max(result_.speed, left(i, load3(&u[3 * size_t{i}])));
      }
      if (result_.error <= kSolved) break;
      for (size_t k = 0; k < q.size(); ++k) q[k] += u[k] - (rows_.velocity(uint32_t(k / 3))[int(k % 3)]);
    }
  }

  bool evaluate_local(const double *, double) override { return true; }  // there is no smooth law
  void spend(uint64_t) override {}
  bool goes_on() override { return true; }
  bool judge(Residual &residual) override {
    std::vector<double> u;
    residual = {};
    for (uint32_t i = 0; i < n_; ++i) {
      const Vec3 v = rows_.velocity(i);
      u.insert(u.end(), {v.x, v.y, v.z});
      residual.speed = std::max(residual.speed, left(i, v));
    }
    residual.normal = residual.speed;
    residual.required = residual.relative =
        siconos_error(problem_, u, rows_.impulse.data()) / (0.1 * kSolved);
    return true;
  }

 private:
  static constexpr double kStep = 1, kShare = 1e-9;
  static constexpr double kAdded = 1e-7;
  static constexpr uint32_t kRuns = 20;
  const LocalProblem &problem_;
  uint32_t n_;
  Result &result_;
  ContactNewton newton_{Memory::standard()};
  ContactRows rows_{Memory::standard()};
  ContactState state_;
  double scale_ = 0;  // m/s

  void set_response(double added) {
    const Matrix &W = problem_.W;
    const double most = std::ranges::max(W.value);
    rows_.set_response(rows_.blocks[0], false, [&](double *to) {
      for (size_t r = 0; r < W.rows; ++r)
        for (size_t c = 0; c < W.rows; ++c) *to++ = 0.5 * (W(r, c) + W(c, r)) + (r == c ? added * most : 0);
    });
  }
  // m/s, that the impulse of contact i is off by at velocity u
  double left(uint32_t i, Vec3 u) const {
    const Vec3 r = load3(&rows_.impulse[3 * size_t{i}]);
    const double w = rows_.wt[i], normal = std::fabs(std::min(rows_.wn[i] * r.x, u.x));
    if (!(w > 0)) return normal;
    const double a = r.y - u.y / w, b = r.z - u.z / w, size = cli::plane_length(a, b),
                 limit = problem_.mu[i] * std::max(0.0, r.x), share = size > limit ? limit / size : 1;
    return std::max(normal, w * cli::plane_length(r.y - share * a, r.z - share * b));
  }
};

}  // namespace

Result solve(const LocalProblem &problem) {
  Result result;
  result.contacts = uint32_t(problem.mu.size());
  Solve own(problem, result);
  const std::clock_t start = std::clock();
  own.run();
  result.seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
  result.solved = result.error <= kSolved;
  return result;
}

}  // namespace contact
