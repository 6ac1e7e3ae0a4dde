// A model of tetrahedra whose instances may have other cells too: a body of either kind behind one table.
#pragma once
#include "cell_body.h"

namespace model {

// Tet: the body of tetrahedra, of the model that Tet::kOf describes.
template <class Tet>
struct ByKind {
  static constexpr uint32_t kCells = kAllCells;
  using Row = typename Tet::Row;
  const dfm_host *host = nullptr;
  bool by_cells = false;
  Tet tet;
  CellBody cells;

  void create(const dfm_host *h, const dfm_mesh &m) {
    host = h;
    by_cells = m.cell != DFM_CELL_TET;
    if (by_cells) cells.create(h, m, Tet::kOf);
    else tet.create(h, m);
  }
  // The body that the instance has.
  template <class Use>
  auto with(const Use &use) {
    return by_cells ? use(cells) : use(tet);
  }
  template <class Use>
  auto with(const Use &use) const {
    return by_cells ? use(cells) : use(tet);
  }

  void apply_params(const double *values) {
    with([&](auto &b) { b.apply_params(values); });
  }
  bool plastic() const {
    return with([](auto &b) { return b.plastic(); });
  }
  size_t state_size() const {
    return with([](auto &b) { return b.state_size(); });
  }
  bool lacks_state(const dfm_kin &k) const {
    return with([&](auto &b) { return b.lacks_state(k); });
  }
  void add_forces(const dfm_kin &k, double *f) {
    with([&](auto &b) { b.add_forces(k, f); });
  }
  void bound(const dfm_kin &k, double *ksum, double *csum) {
    with([&](auto &b) { b.bound(k, ksum, csum); });
  }
  double energy(const dfm_kin &k) {
    return with([&](auto &b) { return b.energy(k); });
  }
  void cell_energy(const dfm_kin &k, double *density) {
    with([&](auto &b) { b.cell_energy(k, density); });
  }
  void cell_stress(const dfm_kin &k, double *stress) {
    with([&](auto &b) { b.cell_stress(k, stress); });
  }
  uint32_t pairs() const {
    return with([](auto &b) { return b.pairs(); });
  }
  void pattern(uint32_t *ij) const {
    with([&](auto &b) { b.pattern(ij); });
  }
  void add_stiffness(const dfm_kin &k, double a, double b, double *blk) {
    with([&](auto &body) { body.add_stiffness(k, a, b, blk); });
  }
  const char *const *active() const {
    return with([](auto &b) -> const char *const * { return b.active_effects; });
  }
  const char *idle(Row which) const {
    return with([&](auto &b) { return b.idle(which); });
  }
};

}  // namespace model
