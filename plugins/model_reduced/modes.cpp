#include "modes.h"

#include <algorithm>
#include <cmath>

#include "../model_common/entry.h"

namespace reduced {
namespace {

constexpr double kTurn = 6.283185307179586;

using model::refuse;

struct Search {
  const Elastic &body;
  size_t size;
  std::vector<double> root;  // [size] square roots of the masses
  std::vector<double> in;    // [size,kLanes]
  Pairs pairs;
  std::vector<std::vector<double>> loads;
  std::vector<double> energy;  // twice that of each load's response

  explicit Search(const Elastic &b) : body(b), size(3 * size_t(b.npoint)), root(size), in(kLanes * size) {
    for (size_t j = 0; j < size; ++j) root[j] = std::sqrt(body.mass[j / 3]);
  }
  // With y = M^1/2 w: M^1/2 C M^1/2 y = y / l.
  void find(size_t count) {
    pairs = largest_pairs(
        *body.kernels, size,
        [&](const double *x, double *y) {
          for (size_t j = 0; j < kLanes * size; ++j) in[j] = root[j / kLanes] * x[j];
          body.compliance_of_eight(in.data(), y);
          for (size_t j = 0; j < kLanes * size; ++j) y[j] *= root[j / kLanes];
        },
        count);
    if (pairs.value.empty()) throw "the mesh has no elastic mode: it has too few points that move";
  }
  double lambda(size_t k) const { return 1 / pairs.value[k]; }
  double hertz(size_t k) const { return std::sqrt(lambda(k)) / kTurn; }

  // Loads of either sign and one size on each component of each surfel: the mean over all choices of signs is
  // the sum over single loads.
  void load_surface(const dfm_mesh &m) {
    uint64_t random = 0x9e3779b97f4a7c15u;
    std::vector<double> u(size);
    for (int n = 0; n < 8; ++n) {
      std::vector<double> f(size, 0.0);
      for (uint32_t s = 0; s < m.nsurfel; ++s)
        for (size_t a = 0; a < 3; ++a) {
          random = random * 6364136223846793005u + 1442695040888963407u;
          const double sign = random >> 63 ? 1 : -1;
          for (uint32_t e = m.row[s]; e < m.row[s + 1]; ++e)
            f[3 * size_t(m.col[e]) + a] += sign * m.weight[e];
        }
      body.compliance(f.data(), u.data());
      double sum = 0;
      for (size_t j = 0; j < size; ++j) sum += f[j] * u[j];
      loads.push_back(std::move(f));
      energy.push_back(sum);
    }
  }
  // The share of it that the first k modes represent, for all k.
  std::vector<double> shares() const {
    double all = 0, sum = 0;
    for (const double e : energy) all += e;
    std::vector<double> out;
    for (size_t k = 0; k < pairs.value.size(); ++k) {
      for (const std::vector<double> &f : loads) {
        double along = 0;
        for (size_t j = 0; j < size; ++j) along += f[j] / root[j] * pairs.vector[k][j];
        sum += along * along * pairs.value[k];
      }
      out.push_back(all > 0 ? sum / all : 1);
    }
    return out;
  }
};

}  // namespace

void Modes::create(const dfm_host *host, const char *id, const dfm_mesh &m, const Elastic &body,
                   const double *params) {
  const double frequency = params[kFrequency], wanted_share = params[kShare];
  if ((params[kModes] > 0) + (frequency > 0) + (wanted_share > 0) > 1)
    throw "modes, frequency and share each say how many modes there are; give one of them";
  available = uint32_t(body.nmoving());
  Search search(body);
  search.load_surface(m);
  const size_t most = std::min<size_t>(available, kMaxModes);
  size_t number = std::min<size_t>(most, params[kModes] > 0 ? size_t(params[kModes]) : kDefaultModes);
  const bool by_rule = frequency > 0 || wanted_share > 0;
  for (size_t wanted = number;; wanted = std::min(most, 2 * wanted)) {
    search.find(wanted);
    const std::vector<double> shares = search.shares();
    const size_t found = shares.size();
    size_t below = found;
    if (frequency > 0)
      for (below = 0; below < found && search.hertz(below) <= frequency;) ++below;
    else if (wanted_share > 0)
      for (below = 0; below < found && (below == 0 || shares[below - 1] < wanted_share);) ++below;
    number = below;
    const bool enough = wanted_share > 0 ? shares[below - 1] >= wanted_share : below < found;
    if (!by_rule || enough || (found < wanted || wanted == available)) break;
    if (wanted < most) continue;
    if (frequency > 0)
      refuse(host, id, "more than %u modes lie below the frequency %g Hz; give a lower one, or modes",
             kMaxModes, frequency);
    refuse(host, id, "%u modes hold %.3g of the static response, less than share; give less, or modes",
           kMaxModes, shares.back());
  }
  if (!number)
    refuse(host, id, "no mode lies below the frequency %g Hz; the lowest has %.4g Hz", frequency,
           search.hertz(0));
  count = uint32_t(number);
  share = search.shares()[number - 1];
  lambda.create(host, count);
  const size_t padded = Basis::padded(search.size);
  shape.create(host, body.kernels, search.size, count);
  std::vector<double> w(padded, 0.0);
  for (uint32_t k = 0; k < count; ++k) {
    lambda[k] = search.lambda(k);
    for (size_t j = 0; j < search.size; ++j) w[j] = search.pairs.vector[k][j] / search.root[j];
    shape.set(k, w.data());
    model::say(host, 0, id, "mode %u has %.15g Hz", k + 1, search.hertz(k));
  }
}

}  // namespace reduced
