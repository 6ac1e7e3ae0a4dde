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
};

}  // namespace model
