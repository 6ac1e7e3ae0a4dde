// Frictional contact problems of others (contact_files.h) by ContactNewton, one line each: size, rank,
// passes, Newton steps, products, error in Siconos' measure and in m/s, CPU time; beside it how many of
// Siconos' solvers have found a solution and how long the fastest took, from FOLDER/siconos_results.txt.
//
//     contact_problems FOLDER [NAME]
//
// Error: the natural map |r - P(r - (u + mu |u_t| n))| over |q|, P the projection on the cone. Solved: at
// most 1e-8, Siconos' own tolerance.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "contact/newton.h"
#include "contact_files.h"

namespace {

using namespace dfm;
using test::ContactProblem;
using test::Dense;

constexpr double kSolved = 1e-8;

// Of one contact: u with the term of its friction, r, mu.
double natural_map(Vec3 u, Vec3 r, double mu) {
  const Vec3 z = r - (u + Vec3{mu * std::hypot(u.y, u.z), 0, 0});
  const double size = std::hypot(z.y, z.z);
  Vec3 p = z;
  if (size > mu * z.x) {
    const double normal = (z.x + mu * size) / (1 + mu * mu);
    p = normal <= 0 ? Vec3{} : Vec3{normal, normal * mu * z.y / size, normal * mu * z.z / size};
  }
  return dot(r - p, r - p);
}
double siconos_error(const ContactProblem &p, const std::vector<double> &u, const double *r) {
  double sum = 0, size = 0;
  for (size_t i = 0; i < p.mu.size(); ++i) sum += natural_map(load3(&u[3 * i]), load3(r + 3 * i), p.mu[i]);
  for (const double q : p.q) size += q * q;
  return std::sqrt(sum) / (size > 0 ? std::sqrt(size) : 1);
}

// All contacts touch a point each of a body that steps itself, the response of which is W.
class Solve final : public NewtonHost {
 public:
  explicit Solve(const ContactProblem &problem) : problem_(problem), n_(uint32_t(problem.mu.size())) {
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
    std::fill(state_.form.begin(), state_.form.end(), uint8_t{kSetValuedLaw});
    for (const double q : problem.q) scale_ = std::max(scale_, std::fabs(q));
  }
  // Parts of W that are not symmetric, or that its factor leaves, go into q of the next round. So does a
  // share of its largest entry that is added to the diagonal where a round has found no solution: a W that
  // is assembled with errors has negative eigenvalues, and rows may contradict each other by as much.
  void run() {
    const std::vector<uint32_t> contacts = all_contacts();
    const uint32_t block = 0;
    ContactRows::Motions motions;
    rows_.motions(contacts, {&block, 1}, motions);
    rank = motions.rank;
    ImplicitSystem *const none = nullptr;
    std::vector<double> q = problem_.q;
    for (rounds = 0; rounds < kRounds;) {
      if (rounds++ > 0 && newton.residual().due > 1) set_response(kAdded);
      for (size_t k = 0; k < q.size(); ++k)
        rows_.y_free[4 * (k / 3) + k % 3] = rows_.y[4 * (k / 3) + k % 3] = q[k];
      const std::vector<double> before(rows_.impulse.begin(), rows_.impulse.end());
      newton.begin(rows_, rows_.whole(), {&none, 1}, state_, *this, kStep);
      if (!newton.solve(kShare * scale_, kShare * scale_)) break;
      passes += newton.passes();
      steps += newton.steps();
      products += newton.products();
      factors += newton.factors();
      const std::vector<double> r(rows_.impulse.begin(), rows_.impulse.end());
      std::vector<double> u = problem_.W * r;
      for (size_t k = 0; k < u.size(); ++k) u[k] += problem_.q[k];
      const double now = siconos_error(problem_, u, r.data());
      if (now < error) {
        error = now;
        speed = 0;
        for (uint32_t i = 0; i < n_; ++i) speed = std::max(speed, left(i, load3(&u[3 * size_t{i}])));
      }
      if (error <= kSolved) break;
      for (size_t k = 0; k < q.size(); ++k) q[k] += u[k] - (rows_.velocity(uint32_t(k / 3))[int(k % 3)]);
    }
  }

  bool answer(const double *) override {
    ContactState &s = state_;
    for (uint32_t i = 0; i < n_; ++i) {
      const uint32_t second = s.stride + i;
      const double mu = problem_.mu[i], size = std::hypot(s.ft_stop[i], s.ft_stop[second]);
      s.limit[i] = mu * s.fn[i];
      s.mode[i] = size > s.limit[i] ? 2 : 1;
      for (const uint32_t at : {i, second}) {
        s.ft[at] = (s.mode[i] == 2 ? s.limit[i] / size : 1) * s.ft_stop[at];
        s.dft_dfn[at] = s.mode[i] == 2 ? mu * s.ft_stop[at] / size : 0;
      }
    }
    return true;
  }
  bool slopes() override { return true; }
  bool goes_on(uint32_t) override { return true; }
  bool judge(Residual &residual) override {
    std::vector<double> u;
    residual = {};
    for (uint32_t i = 0; i < n_; ++i) {
      const Vec3 v = rows_.velocity(i);
      u.insert(u.end(), {v.x, v.y, v.z});
      residual.speed = std::max(residual.speed, left(i, v));
    }
    residual.normal = residual.speed;
    residual.due = residual.relative = siconos_error(problem_, u, rows_.impulse.data()) / (0.1 * kSolved);
    return true;
  }

  ContactNewton newton{Memory::standard()};
  uint32_t rank = 0, rounds = 0, passes = 0, steps = 0, products = 0, factors = 0;
  double error = HUGE_VAL, speed = HUGE_VAL;

 private:
  static constexpr double kStep = 1, kShare = 1e-9;
  static constexpr double kAdded = 1e-7;
  static constexpr uint32_t kRounds = 20;
  const ContactProblem &problem_;
  uint32_t n_;
  ContactRows rows_{Memory::standard()};
  ContactState state_;
  double scale_ = 0;  // m/s

  void set_response(double added) {
    const Dense &W = problem_.W;
    const double most = *std::max_element(W.value.begin(), W.value.end());
    rows_.set_response(rows_.blocks[0], [&](double *to) {
      for (size_t r = 0; r < W.rows; ++r)
        for (size_t c = 0; c < W.rows; ++c) *to++ = 0.5 * (W(r, c) + W(c, r)) + (r == c ? added * most : 0);
    });
  }
  std::vector<uint32_t> all_contacts() const {
    std::vector<uint32_t> out(n_);
    for (uint32_t i = 0; i < n_; ++i) out[i] = i;
    return out;
  }
  // m/s, that the impulse of contact i is off by at velocity u
  double left(uint32_t i, Vec3 u) const {
    const Vec3 r = load3(&rows_.impulse[3 * size_t{i}]);
    const double w = rows_.wt[i], normal = std::fabs(std::min(rows_.wn[i] * r.x, u.x));
    if (!(w > 0)) return normal;
    const double a = r.y - u.y / w, b = r.z - u.z / w, size = std::hypot(a, b),
                 limit = problem_.mu[i] * std::max(0.0, r.x), share = size > limit ? limit / size : 1;
    return std::max(normal, w * std::hypot(r.y - share * a, r.z - share * b));
  }
};

// "4 of 5, 0.08 s" of Siconos' solvers; names are cut in its table.
std::string of_siconos(const std::string &folder, const std::string &name) {
  std::ifstream in(folder + "/siconos_results.txt");
  uint32_t tried = 0, solved = 0;
  double best = HUGE_VAL;
  for (std::string line; std::getline(in, line);) {
    const std::string first = line.substr(0, line.find(' '));
    if (name.rfind(first, 0) != 0 || (first.size() < 38 && first != name)) continue;
    ++tried;
    const size_t cpu = line.find("cpu=");
    if (line.find("info=0") == std::string::npos || cpu == std::string::npos) continue;
    ++solved;
    best = std::min(best, std::strtod(line.c_str() + cpu + 4, nullptr));
  }
  if (!tried) return "-";
  std::ostringstream out;
  out << solved << " of " << tried;
  if (solved) out << ", " << best << " s";
  return out.str();
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: contact_problems FOLDER [NAME]\n");
    return 2;
  }
  const std::string folder = argv[1];
  std::vector<std::string> names;
  for (const auto &file : std::filesystem::directory_iterator(folder)) {
    const std::string name = file.path().filename().string(), end = file.path().extension().string();
    if ((end == ".dat" || end == ".hdf5") && (argc < 3 || name.find(argv[2]) != std::string::npos))
      names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  std::printf("%-44s %4s %9s %3s %5s %5s %6s %4s %8s %8s %7s  %s\n", "problem", "nc", "rank", "run", "pass",
              "step", "prod", "fact", "error", "m/s", "s", "Siconos");
  uint32_t read = 0, solved = 0;
  for (const std::string &name : names) try {
      const ContactProblem problem = test::read_contact_problem(folder + "/" + name);
      const std::clock_t start = std::clock();
      Solve solve(problem);
      solve.run();
      const double seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
      ++read;
      solved += solve.error <= kSolved;
      std::printf("%-44s %4zu %4u/%4zu %3u %5u %5u %6u %4u %8.1e %8.1e %7.3f  %s%s\n", name.c_str(),
                  problem.mu.size(), solve.rank, problem.q.size(), solve.rounds, solve.passes, solve.steps,
                  solve.products, solve.factors, solve.error, solve.speed, seconds,
                  of_siconos(folder, name).c_str(), solve.error <= kSolved ? "" : "  UNSOLVED");
      std::fflush(stdout);
    } catch (const std::exception &e) {
      std::printf("%-44s not read: %s\n", name.c_str(), e.what());
    }
  std::printf("%u of %u solved to %g\n", solved, read, kSolved);
  return solved == read ? 0 : 1;
}
