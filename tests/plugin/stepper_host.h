// A self-stepping plugin on the host of model_host.h: what a step needs, and a step itself.
#pragma once
#include "model_host.h"

namespace stepper_test {

using namespace model_test;

// Values by key, for each component of a wide one; what is not named has its default.
using Params = std::map<std::string, double>;

inline std::vector<double> row_of(const dfm_type &type, const Params &p) {
  std::vector<double> values;
  size_t used = 0;
  for (uint32_t n = 0; n < type.nparam; ++n) {
    const auto given = p.find(type.params[n].key);
    used += given != p.end();
    values.insert(values.end(), type.params[n].width, given != p.end() ? given->second : type.params[n].def);
  }
  EXPECT_EQ(used, p.size()) << "a parameter that the model lacks";
  return values;
}

// Bits of the points at x = least.
inline std::vector<uint8_t> clamp_of(const Mesh &m) {
  double least = 1e300;
  for (uint32_t i = 0; i < m.npoint(); ++i) least = std::min(least, m.at(i)[0]);
  std::vector<uint8_t> fixed(m.npoint(), 0);
  for (uint32_t i = 0; i < m.npoint(); ++i)
    if (m.at(i)[0] < least + 1e-9) fixed[i] = 7;
  return fixed;
}

struct Stepper : ModelInstance {
  const dfm_stepper *ext = nullptr;
  std::vector<double> u_s, p_s, x_end, v_end;  // f: external forces

  Stepper(Host &h, const dfm_type &type, const Mesh &m, const Params &p = {},
          const std::vector<uint8_t> &fixed = {}, bool blended = false)
      : ModelInstance(h, type, m, row_of(type, p), 4, {}, fixed, blended) {
    if (status != DFM_OK) return;
    ext = static_cast<const dfm_stepper *>(ops->extension(self, "dfm.stepper/1"));
    for (std::vector<double> *a : {&u_s, &p_s}) a->assign(3 * size_t(m.npoint()), 0.0);
    for (std::vector<double> *a : {&x_end, &v_end}) a->assign(4 * size_t(m.npoint()), 0.0);
  }
  void pull(Vec acceleration) {
    for (uint32_t i = 0; i < size(); ++i) set(f, i, mesh.mass[i] * acceleration);
  }
  dfm_kin now() {
    dfm_kin k = kin();
    k.state_out = state_out.data();
    return k;
  }
  void predict() {
    const dfm_kin k = now();
    ASSERT_EQ(ext->predict(self, &k, f, u_s.data()), DFM_OK) << host.logged;
  }
  std::vector<double> respond(const std::vector<uint32_t> &surfels, const std::vector<double> &p) {
    std::vector<double> du(3 * surfels.size());
    const dfm_kin k = now();
    EXPECT_EQ(ext->respond(self, &k, uint32_t(surfels.size()), surfels.data(), p.data(), du.data()), DFM_OK);
    return du;
  }
  void commit() {
    const dfm_kin k = now();
    ASSERT_EQ(ext->commit(self, &k, p_s.data(), x_end.data(), v_end.data()), DFM_OK);
  }
  void step() {
    predict();
    commit();
    std::copy(x_end.begin(), x_end.end(), x);
    std::copy(v_end.begin(), v_end.end(), v);
    state.swap(state_out);
    t += dt;
  }
  void advance(double h) {
    dt = h;
    step();
  }
  Vec momentum() const {
    Vec sum{};
    for (uint32_t i = 0; i < size(); ++i) sum = sum + mesh.mass[i] * get(v, i);
    return sum;
  }
  // About the origin of the world.
  Vec angular_momentum() const {
    Vec sum{};
    for (uint32_t i = 0; i < size(); ++i) sum = sum + mesh.mass[i] * cross(get(x, i), get(v, i));
    return sum;
  }
  double kinetic() const {
    double sum = 0;
    for (uint32_t i = 0; i < size(); ++i) sum += 0.5 * mesh.mass[i] * dot(get(v, i), get(v, i));
    return sum;
  }
};

// Hz, of the log of a body's creation.
inline std::vector<double> frequencies(const std::string &logged) {
  std::vector<double> out;
  std::istringstream lines(logged);
  for (std::string line; std::getline(lines, line);) {
    const size_t at = line.find(" has "), mode = line.find("mode ");
    if (at != std::string::npos && mode < at) out.push_back(std::strtod(line.c_str() + at + 5, nullptr));
  }
  return out;
}

// Impulses at the surfels change the velocities by a symmetric operator without negative directions; the
// state that commit leaves is that of predict and respond together.
inline void expect_commit_is_predict_and_respond(Stepper &b, const std::vector<uint32_t> &surfels) {
  b.predict();
  const uint32_t n = uint32_t(surfels.size()), width = 3 * n;
  std::vector<double> unit(width * width, 0), response(width * width, 0), diagonal(9 * n);
  for (uint32_t c = 0; c < width; ++c) unit[c * width + c] = 1;
  const dfm_kin k = b.now();
  ASSERT_EQ(b.ext->respond_many(b.self, &k, n, surfels.data(), width, unit.data(), response.data()), DFM_OK);
  ASSERT_EQ(b.ext->diagonal(b.self, &k, n, surfels.data(), diagonal.data()), DFM_OK);
  double most = 0;
  for (const double a : response) most = std::max(most, std::abs(a));
  for (uint32_t r = 0; r < width; ++r) {
    for (uint32_t c = 0; c < width; ++c)
      EXPECT_NEAR(response[r * width + c], response[c * width + r], 1e-12 * most);
    for (uint32_t c = 0; c < 3; ++c)
      EXPECT_NEAR(diagonal[9 * (r / 3) + 3 * (r % 3) + c], response[(3 * (r / 3) + c) * width + r],
                  1e-12 * most);
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  std::fill(b.p_s.begin(), b.p_s.end(), 0.0);
  std::vector<double> p(width), du(width, 0.0);
  const double size = 1e-3 / most;  // a change of about 1 mm/s
  double work = 0;
  for (uint32_t c = 0; c < width; ++c) b.p_s[3 * surfels[c / 3] + c % 3] = p[c] = size * any(random);
  for (uint32_t c = 0; c < width; ++c)
    for (uint32_t r = 0; r < width; ++r) du[r] += response[c * width + r] * p[c];
  for (uint32_t c = 0; c < width; ++c) work += p[c] * du[c];
  EXPECT_GT(work, 0);
  b.commit();
  for (uint32_t c = 0; c < width; ++c) {
    const size_t at = 4 * size_t(surfels[c / 3]) + c % 3;
    const double mean = (b.x_end[at] - b.x[at]) / b.dt;
    EXPECT_NEAR(mean, b.u_s[3 * surfels[c / 3] + c % 3] + du[c], 1e-10) << "surfel " << surfels[c / 3];
  }
}

}  // namespace stepper_test
