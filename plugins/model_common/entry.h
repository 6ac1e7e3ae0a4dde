// The entry shared by all models on tetrahedra: checks parameters and mesh, creates an instance in the host's
// memory, and returns failures as a status after logging a message.
#pragma once
#include <deform/plugin.hpp>

#include <cstdarg>
#include <cstdio>
#include <iterator>
#include <new>

namespace model {

struct Refused {};  // thrown after the reason was logged

// At a level of dfm_host.log; `who` begins the message, `what` ends without a full stop.
[[gnu::format(printf, 4, 0)]] inline void vsay(const dfm_host *h, int32_t level, const char *who,
                                               const char *what, va_list values) {
  char own[360], text[400];
  vsnprintf(own, sizeof own, what, values);
  snprintf(text, sizeof text, "%s: %s.", who, own);
  h->log(h->ctx, level, 0, text);
}
[[gnu::format(printf, 4, 5)]] inline void say(const dfm_host *h, int32_t level, const char *who,
                                              const char *what, ...) {
  va_list values;
  va_start(values, what);
  vsay(h, level, who, what, values);
  va_end(values);
}
inline void complain(const dfm_host *h, const char *who, const char *what) { say(h, 3, who, "%s", what); }
[[noreturn, gnu::format(printf, 3, 4)]] inline void refuse(const dfm_host *h, const char *who,
                                                           const char *what, ...) {
  va_list values;
  va_start(values, what);
  vsay(h, 3, who, what, values);
  va_end(values);
  throw Refused{};
}

inline bool has_direction(const double *a) { return a[0] * a[0] + a[1] * a[1] + a[2] * a[2] > 0; }

// Values of all rows end to end; false after the reason was logged.
inline bool in_range(const dfm_host *h, const char *who, const dfm_param *rows, uint32_t nrow,
                     const double *values) {
  for (uint32_t r = 0; r < nrow; ++r)
    for (uint32_t w = 0; w < rows[r].width; ++w, ++values) {
      if (*values >= rows[r].min && *values <= rows[r].max) continue;
      say(h, 3, who, "parameter %s = %g %s is outside %g .. %g", rows[r].key, *values, rows[r].unit,
          rows[r].min, rows[r].max);
      return false;
    }
  return true;
}

// The table of extension "dfm.effect_rows/1".
template <uint32_t N>
constexpr dfm_effect_rows rows_of(const dfm_effect_row (&rows)[N]) {
  return {sizeof(dfm_effect_rows), sizeof(dfm_effect_row), N, 0, rows};
}

// The kinds of cells that a body takes: its kCells, else tetrahedra.
template <class Body>
constexpr uint32_t cells_of() {
  if constexpr (requires { Body::kCells; }) return Body::kCells;
  else return DFM_CELL_TET;
}
constexpr uint32_t kAllCells =
    DFM_CELL_TET | DFM_CELL_TET10 | DFM_CELL_HEX8 | DFM_CELL_HEX20 | DFM_CELL_HEX27;
constexpr uint32_t kMaxNodes = 27;
constexpr uint32_t nodes_of(uint32_t kind) {
  return kind == DFM_CELL_HEX27   ? 27
         : kind == DFM_CELL_HEX20 ? 20
         : kind == DFM_CELL_TET10 ? 10
         : kind == DFM_CELL_HEX8  ? 8
                                  : 4;
}

// Why a model on these kinds of cells, with edges, cannot use the mesh; NULL if it can.
inline const char *wrong_with(const dfm_mesh &m, uint32_t kinds) {
  if (!(m.cell & kinds))
    return kinds == DFM_CELL_TET ? "the cells must be tetrahedra" : "the cells are of an unknown kind";
  if (m.size >= offsetof(dfm_mesh, inside) + sizeof m.inside && m.inside && m.cell != DFM_CELL_HEX8)
    return "parts of cells are material, which is for hexahedra of 8 points";
  if (!m.npoint || !m.ncell || !m.nedge || !m.edges || !m.cells || !m.rest || !m.mass)
    return "the mesh has no cells, points or edges";
  for (size_t n = 0; n < nodes_of(m.cell) * size_t(m.ncell); ++n)
    if (m.cells[n] >= m.npoint) return "a cell names a point that the mesh lacks";
  for (size_t n = 0; n < 2 * size_t(m.nedge); ++n)
    if (m.edges[n] >= m.npoint) return "an edge names a point that the mesh lacks";
  return nullptr;
}

// A Body in the host's memory; body.create(h, m) may throw Refused, a message, or any exception if memory
// runs out.
template <class Body>
dfm_status create(const dfm_host *h, const dfm_mesh *m, const char *who, void **self) {
  *self = nullptr;
  if (const char *wrong = wrong_with(*m, cells_of<Body>())) {
    complain(h, who, wrong);
    return DFM_E_ARG;
  }
  void *memory = h->alloc(h->ctx, sizeof(Body), 64);
  if (!memory) return DFM_E_NOMEM;
  Body *body = new (memory) Body;
  dfm_status status = DFM_OK;
  try {
    body->create(h, *m);
  } catch (const Refused &) {
    status = DFM_E_ARG;
  } catch (const char *wrong) {
    complain(h, who, wrong);
    status = DFM_E_ARG;
  } catch (...) {
    status = DFM_E_NOMEM;
  }
  if (status == DFM_OK) {
    *self = body;
    return DFM_OK;
  }
  body->~Body();
  h->release(h->ctx, memory, sizeof(Body), 64);
  return status;
}

// What the instance is made of: one of the two bodies of ByKind, else the body itself.
template <class Body, class Use>
auto on(Body &body, const Use &use) {
  if constexpr (requires { body.by_cells; }) return body.with(use);
  else return use(body);
}

// New values for an instance; body.apply_params(values) changes nothing if it throws.
template <class Body>
dfm_status change(Body &body, const double *values) {
  try {
    on(body, [&](auto &b) { b.apply_params(values); });
  } catch (const Refused &) {
    return DFM_E_ARG;
  } catch (...) {
    return DFM_E_NOMEM;
  }
  return DFM_OK;
}

// The same for values that need only be in the range of their rows.
template <class Body, uint32_t kCount>
dfm_status change_in_range(void *self, const char *who, const dfm_param (&rows)[kCount],
                           const double *values) {
  Body &body = *static_cast<Body *>(self);
  return in_range(body.host, who, rows, kCount, values) ? change(body, values) : DFM_E_ARG;
}

// No exception leaves a call of the host.
template <class Use>
dfm_status answered(const Use &use) {
  try {
    use();
  } catch (const std::bad_alloc &) {
    return DFM_E_NOMEM;
  } catch (...) {
    return DFM_E_FATAL;
  }
  return DFM_OK;
}

// Entries of a model whose parameters need only be in the range of their rows.
template <class Body, const char *const &kWho, auto &kRows>
struct InRange {
  static dfm_status create(const dfm_host *h, const dfm_mesh *m, void **self) {
    *self = nullptr;
    return in_range(h, kWho, kRows, std::size(kRows), m->params) ? model::create<Body>(h, m, kWho, self)
                                                                 : DFM_E_ARG;
  }
  static dfm_status set_params(void *self, const double *params) {
    return change_in_range<Body>(self, kWho, kRows, params);
  }
};

// Ops and extensions as calls of the Body. Its lacks_state(k) is true, and has said so, where the host gives
// none that it needs; rows of its parameters are numbered by its Row.
template <class Body>
struct Ops {
  template <class Use>
  static dfm_status with_state(void *self, const dfm_kin *k, const Use &use) {
    return on(*static_cast<Body *>(self),
              [&](auto &body) { return body.lacks_state(*k) ? DFM_E_STATE : answered([&] { use(body); }); });
  }
  static dfm_status add_forces(void *self, const dfm_kin *k, double *f) {
    return with_state(self, k, [&](auto &body) { body.add_forces(*k, f); });
  }
  static dfm_status bound(void *self, const dfm_kin *k, double *ksum, double *csum, double *) {
    return with_state(self, k, [&](auto &body) { body.bound(*k, ksum, csum); });
  }
  static dfm_status energy(void *self, const dfm_kin *k, double *joule) {
    return with_state(self, k, [&](auto &body) { *joule = body.energy(*k); });
  }
  static dfm_status pattern(const void *self, uint32_t *nb, uint32_t *ij) {
    try {
      on(*static_cast<const Body *>(self), [&](auto &body) {
        *nb = body.pairs();
        if (ij) body.pattern(ij);
      });
    } catch (...) {
      return DFM_E_NOMEM;
    }
    return DFM_OK;
  }
  static dfm_status stiffness(void *self, const dfm_kin *k, double a, double b, double *blk) {
    return with_state(self, k, [&](auto &body) { body.add_stiffness(*k, a, b, blk); });
  }
  static dfm_status cell_energy(void *self, const dfm_kin *k, double *density) {
    return with_state(self, k, [&](auto &body) { body.cell_energy(*k, density); });
  }
  static dfm_status cell_stress(void *self, const dfm_kin *k, double *stress) {
    return with_state(self, k, [&](auto &body) { body.cell_stress(*k, stress); });
  }
  static const char *const *active_effects(const void *self) {
    if constexpr (requires(const Body &b) { b.active(); }) return static_cast<const Body *>(self)->active();
    else
      return on(*static_cast<const Body *>(self),
                [](auto &b) -> const char *const * { return b.active_effects; });
  }
  static const char *idle(const void *self, uint32_t row) {
    using Row = typename Body::Row;
    const auto why = [&](auto &body) { return body.idle(Row(row)); };
    return row < Row::kParamCount ? on(*static_cast<const Body *>(self), why) : nullptr;
  }
  static constexpr dfm_cell_energy kCellEnergy = {sizeof(dfm_cell_energy), 0, cell_energy};
  static constexpr dfm_cell_stress kCellStress = {sizeof(dfm_cell_stress), 0, cell_stress};
  static constexpr dfm_effects kActiveEffects = {sizeof(dfm_effects), 0, active_effects};
  static constexpr dfm_idle kIdle = {sizeof(dfm_idle), 0, idle};
};

template <class Body>
void destroy(void *self) {
  Body *body = static_cast<Body *>(self);
  if (!body) return;
  const dfm_host *h = body->host;
  body->~Body();
  h->release(h->ctx, self, sizeof(Body), 64);
}

// The table of a model without forces, energy and stiffness; state_init may be NULL.
template <class Body>
constexpr dfm_model bare_table(uint32_t caps, decltype(dfm_model::create) create,
                               decltype(dfm_model::set_params) set_params,
                               decltype(dfm_model::state_init) state_init,
                               decltype(dfm_model::extension) extension) {
  dfm_model t{};
  t.size = sizeof t;
  t.caps = caps;
  t.cells = cells_of<Body>();
  t.create = create;
  t.destroy = destroy<Body>;
  t.set_params = set_params;
  t.state_init = state_init;
  t.extension = extension;
  return t;
}
template <class Body, class... Of>
constexpr dfm_model table(Of... of) {
  dfm_model t = bare_table<Body>(of...);
  t.add_forces = Ops<Body>::add_forces;
  t.bound = Ops<Body>::bound;
  t.energy = Ops<Body>::energy;
  t.pattern = Ops<Body>::pattern;
  t.stiffness = Ops<Body>::stiffness;
  return t;
}

}  // namespace model
