// A self-stepping model on a mesh of a test, moved through dfm.stepper/1 as a host does.
#pragma once
#include "model_tangent.h"

namespace model_test {

struct Stepper {
  Host &host;
  Mesh mesh;
  const dfm_model *ops;
  const dfm_stepper *step = nullptr;
  void *self = nullptr;
  dfm_status status;
  std::vector<uint32_t> row, col;  // coupling: without one of its own, each point is a surfel
  std::vector<double> weight;
  std::vector<double> x, v, load, state, state_out;  // [npoint,4]
  double t = 0;

  Stepper(Host &h, const dfm_type &type, const Mesh &m, const std::vector<double> &params,
          const std::vector<uint8_t> &fixed = {}, bool blended = false)
      : host(h), mesh(m), ops(static_cast<const dfm_model *>(type.ops)) {
    const uint32_t n = m.npoint();
    std::mt19937 random(3);
    std::uniform_real_distribution<double> u(0.1, 1);
    row.push_back(0);
    for (uint32_t i = 0; i < n; ++i) {  // blended: each surfel hangs on three points
      const double a = u(random), b = u(random);
      for (uint32_t k = 0; k < (blended ? 3u : 1u); ++k) {
        col.push_back((i + 5 * k) % n);
        weight.push_back(!blended ? 1 : k == 0 ? a : k == 1 ? b * (1 - a) : (1 - b) * (1 - a));
      }
      row.push_back(uint32_t(col.size()));
    }
    dfm_mesh d = described(m);
    d.params = params.data();
    d.nsurfel = n;
    d.row = row.data();
    d.col = col.data();
    d.weight = weight.data();
    d.fixed = fixed.empty() ? nullptr : fixed.data();
    status = ops->create(&h.table, &d, &self);
    for (std::vector<double> *a : {&x, &v, &load}) a->assign(4 * size_t(n), 0);
    for (uint32_t i = 0; i < n; ++i) set(x, i, m.at(i));
    if (status != DFM_OK) return;
    step = static_cast<const dfm_stepper *>(ops->extension(self, "dfm.stepper/1"));
    const auto *own = static_cast<const dfm_slots *>(ops->extension(self, DFM_EXT_SLOTS));
    for (uint32_t s = 0; own && s < own->nslot; ++s)
      state.resize(state.size() + own->slots[s].width * (own->slots[s].unit == DFM_PER_POINT ? n : 1));
    if (ops->state_init) ops->state_init(self, state.data());
    state_out = state;
  }
  ~Stepper() { ops->destroy(self); }
  Stepper(const Stepper &) = delete;

  uint32_t size() const { return mesh.npoint(); }
  static Vec get(const std::vector<double> &a, uint32_t i) { return {a[4 * i], a[4 * i + 1], a[4 * i + 2]}; }
  static void set(std::vector<double> &a, uint32_t i, Vec value) {
    std::copy(value.begin(), value.end(), &a[4 * size_t(i)]);
  }
  dfm_kin kin(double h) {
    dfm_kin k{};
    k.size = sizeof k;
    k.stride = 4;
    k.t = t;
    k.dt = h;
    k.x = x.data();
    k.v = v.data();
    k.state = state.data();
    return k;
  }
  std::vector<double> predict(double h) {
    std::vector<double> u(3 * size_t(size()));
    const dfm_kin k = kin(h);
    EXPECT_EQ(step->predict(self, &k, load.data(), u.data()), DFM_OK);
    return u;
  }
  std::vector<double> respond(double h, const std::vector<uint32_t> &surfels, const std::vector<double> &p) {
    std::vector<double> du(3 * surfels.size());
    const dfm_kin k = kin(h);
    EXPECT_EQ(step->respond(self, &k, uint32_t(surfels.size()), surfels.data(), p.data(), du.data()), DFM_OK);
    return du;
  }
  // After predict(h); p [nsurfel,3].
  void commit(double h, const std::vector<double> &p) {
    dfm_kin k = kin(h);
    k.state_out = state_out.data();
    std::vector<double> x_end(x.size()), v_end(v.size());
    EXPECT_EQ(step->commit(self, &k, p.data(), x_end.data(), v_end.data()), DFM_OK);
    x.swap(x_end);
    v.swap(v_end);
    state.swap(state_out);
    t += h;
  }
  void advance(double h) {
    predict(h);
    commit(h, std::vector<double>(3 * size_t(size()), 0));
  }
  void shake(double amount, double speed, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    for (uint32_t i = 0; i < size(); ++i) {
      set(x, i, get(x, i) + amount * Vec{u(random), u(random), u(random)});
      set(v, i, get(v, i) + speed * Vec{u(random), u(random), u(random)});
    }
  }
  Vec momentum() const {
    Vec sum{};
    for (uint32_t i = 0; i < size(); ++i) sum = sum + mesh.mass[i] * get(v, i);
    return sum;
  }
  Vec spin() const {
    Vec sum{};
    for (uint32_t i = 0; i < size(); ++i) sum = sum + mesh.mass[i] * cross(get(x, i), get(v, i));
    return sum;
  }
};

// Column by column, between all surfels: 1/kg.
inline Dense response_of(Stepper &b, double h) {
  const size_t n = 3 * size_t(b.size());
  std::vector<uint32_t> all(b.size());
  for (uint32_t s = 0; s < b.size(); ++s) all[s] = s;
  Dense out(n, n);
  for (size_t c = 0; c < n; ++c) {
    std::vector<double> p(n, 0);
    p[c] = 1;
    const std::vector<double> du = b.respond(h, all, p);
    for (size_t r = 0; r < n; ++r) out(r, c) = du[r];
  }
  return out;
}

}  // namespace model_test
