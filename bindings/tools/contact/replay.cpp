// A captured problem: laws by their plugins, residual and tolerance as in the step.
#include <algorithm>
#include <ctime>
#include <memory>

#include "body/phyxels.h"
#include "contact/newton.h"
#include "contact/row_law.h"
#include "core/error.h"
#include "friction/laws.h"
#include "math/ldlt_solver.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "solve.h"

namespace contact {

using namespace dfm;

namespace {

class Replay final : public SolveLaws {
 public:
  Replay(ContactProblem &problem, const dfm_context &context) : p_(problem), part_(problem.rows.whole()) {
    for (const ContactProblem::Law &law : p_.laws) {
      const dfm_type &type = context.registry.find(DFM_KIND_FRICTION, law.id);
      if (law.params.size() != packed_width(type))
        fail(DFM_E_FORMAT, "the contact problem is of another version of law '%s'", type.id);
      own_.push_back(std::make_unique<LawInstance>(type, context.host, law.params));
      if (own_.back()->nstate > p_.state.nstate)
        fail(DFM_E_FORMAT, "the contact problem has no state of law '%s'", type.id);
      laws_.push_back(own_.back().get());
    }
    for (LinearMotion &m : p_.motions) systems_.push_back(m.n > 0 ? &m : nullptr);
    tolerance_ = {p_.most_normal, p_.bond, p_.normal.data(), p_.tangent.data()};
    batches_.gather(laws_, part_.contacts, p_.state);
  }
  void run(Result &result) {
    double least = part_.nbond ? p_.bond : HUGE_VAL;
    for (const double tangent : p_.tangent) least = std::min(least, tangent);
    newton_.begin(p_.rows, part_, systems_, p_.state, *this, p_.h);
    result.solved = newton_.solve(least, p_.most_normal) && newton_.residual().required <= 1;
    result.speed = newton_.residual().speed;
    result.passes = newton_.passes();
    result.steps = newton_.steps();
    result.products = newton_.products();
    result.factors = newton_.factors();
  }
  // At the solution: limits of friction, and what rows give way under their load. mu is empty where a law
  // remembers or something is attached.
  LocalProblem form();

  bool evaluate_local(const double *response, double slip) override {
    return !batches_.evaluate_local(p_.h, response, slip, 0, p_.state, false);
  }
  bool judge(Residual &residual) override {
    set_trial(p_.rows, part_, p_.h, p_.rows.wt.data(), p_.state);
    if (batches_.evaluate_local(p_.h, p_.rows.wt.data(), 0.1 * p_.rest, 1e-2, p_.state)) return false;
    linearize(p_.rows, part_, p_.h, p_.state);
    residual = residual_of(p_.rows, part_, p_.state, p_.h, tolerance_);
    return true;
  }
  void spend(uint64_t) override {}
  bool goes_on() override { return true; }

 private:
  ContactProblem &p_;
  RowsPart part_;
  std::vector<std::unique_ptr<LawInstance>> own_;
  std::vector<LawInstance *> laws_;
  std::vector<ImplicitSystem *> systems_;
  LawBatches batches_{Memory::standard()};
  Tolerance tolerance_;
  ContactNewton newton_{Memory::standard()};
};

// What impulses change of the points of an implicit body.
class Responder {
 public:
  explicit Responder(LinearMotion &m)
      : m_(m), solver_(Memory::standard()), x_(3 * size_t{m.n}), b_(x_.size()) {
    solver_.analyse(m.pattern());
    if (!solver_.factor(m.blocks())) fail(DFM_E_FORMAT, "the matrix of an implicit body has no factor");
  }
  // of its points, [n,3] N s
  const std::vector<double> &of(const std::vector<double> &impulses) {
    for (size_t k = 0; k < b_.size(); ++k)
      b_[k] = m_.diagonal_inverse()[size_t{kStride} * (k / 3) + k % 3] > 0 ? impulses[k] : 0;
    SolveInfo info;
    solver_.solve(1, b_.data(), x_.data(), 0, info);
    return x_;
  }
  // m/s, without contact
  std::vector<double> free() {
    std::vector<double> r(x_.size());
    m_.residual(m_.start(), r.data());
    for (double &value : r) value = -value;
    std::vector<double> v = of(r);
    for (size_t k = 0; k < v.size(); ++k) v[k] += m_.start()[size_t{kStride} * (k / 3) + k % 3];
    return v;
  }

 private:
  LinearMotion &m_;
  LdltSolver solver_;
  std::vector<double> x_, b_;
};

LocalProblem Replay::form() {
  ContactRows &rows = p_.rows;
  const ContactState &s = p_.state;
  const size_t n = rows.n;
  LocalProblem out;
  if (!part_.nbond && std::count(s.form.begin(), s.form.begin() + std::ptrdiff_t(n), kSmoothLaw) == 0)
    for (size_t i = 0; i < n; ++i)
      out.mu.push_back(s.form[i] == kSetValuedLaw && s.fn[i] > 0 ? s.limit[i] / s.fn[i] : 0);
  std::vector<std::unique_ptr<Responder>> responders;
  for (LinearMotion &m : p_.motions) responders.push_back(m.n > 0 ? std::make_unique<Responder>(m) : nullptr);
  Array<double> y = rows.y_free;
  const auto put = [&](uint32_t source, const std::vector<double> &x) {
    for (uint32_t d = 0; d < rows.ndof; ++d)
      if (rows.block[d] == kNone && rows.source[d] == source)
        std::copy_n(&x[3 * size_t{rows.point[d]}], 3, &y[size_t{kStride} * d]);
  };
  for (uint32_t k = 0; k < responders.size(); ++k)
    if (responders[k]) put(k, responders[k]->free());
  out.q.resize(3 * n);
  for (uint32_t i = 0; i < n; ++i) {
    const Vec3 u = rows.velocity(i, y.data());
    store3(&out.q[3 * size_t{i}], u);
    out.q[3 * size_t{i}] +=
        rows.rate[i] + yield_speed(rows.impulse[3 * size_t{i}], &rows.compliance[3 * size_t{i}]);
  }
  out.W = Matrix(3 * n, 3 * n);
  const Array<double> solution = rows.y;
  for (uint32_t c = 0; c < 3 * n; ++c) {
    const uint32_t i = c / 3;
    Vec3 unit;
    unit[int(c % 3)] = 1;
    std::ranges::fill(rows.y, 0.0);
    rows.apply(i, unit);
    y = rows.y;
    const Vec3 push = load3(&rows.frame[size_t{9} * i + 3 * (c % 3)]);
    for (uint32_t k = 0; k < responders.size(); ++k) {
      if (!responders[k]) continue;
      std::vector<double> impulses(3 * size_t{p_.motions[k].n});
      for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j)
        if (const uint32_t d = rows.dof[j]; rows.block[d] == kNone && rows.source[d] == k)
          store3(&impulses[3 * size_t{rows.point[d]}],
                 load3(&impulses[3 * size_t{rows.point[d]}]) + rows.weight[j] * push);
      put(k, responders[k]->of(impulses));
    }
    for (uint32_t j = 0; j < n; ++j) {
      const Vec3 u = rows.velocity(j, y.data()) + load3(&rows.drive[3 * size_t{j}]);
      for (size_t r = 0; r < 3; ++r) out.W(3 * size_t{j} + r, c) = u[int(r)];
    }
  }
  rows.y = solution;
  return out;
}

}  // namespace

Result solve(ContactProblem &problem, dfm_context *context, LocalProblem &form) {
  Result result;
  result.contacts = problem.rows.n;
  result.bonds = problem.rows.nbond;
  result.implicit = std::ranges::any_of(problem.motions, [](const LinearMotion &m) { return m.n > 0; });
  Replay replay(problem, *context);
  const std::clock_t start = std::clock();
  replay.run(result);
  result.seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
  form = replay.form();
  result.rank = rank_of(form.W);
  result.error = NAN;
  if (form.mu.empty()) return result;
  const double *const r = problem.rows.impulse.data();
  result.error = siconos_error(form, velocities(form, r), r);
  return result;
}

}  // namespace contact
