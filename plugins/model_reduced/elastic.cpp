#include "elastic.h"

#include <algorithm>
#include <cmath>

#include "../model_common/edges.h"
#include "../model_common/params.h"
#include "../model_common/width.h"
#include "small.h"

namespace reduced {

namespace {

// Rows of the rigid motions about the origin, at x: three translations, three rotations.
void rigid_rows(const double *x, double (*g)[6]) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 6; ++c) g[r][c] = c == r;
  g[0][4] = x[2];
  g[0][5] = -x[1];
  g[1][3] = -x[2];
  g[1][5] = x[0];
  g[2][3] = x[1];
  g[2][4] = -x[0];
}

// Six rows that span the rigid motions best, by repeated choice of what is longest beside the rows before.
// The number of them whose rest is longer than 1e-6 of the first's.
int independent_rows(std::vector<std::array<double, 6>> rows, std::vector<uint32_t> &chosen) {
  double first = 0;
  for (int k = 0; k < 6; ++k) {
    size_t best = 0;
    double most = -1;
    for (size_t r = 0; r < rows.size(); ++r) {
      double square = 0;
      for (const double a : rows[r]) square += a * a;
      if (square > most) {
        most = square;
        best = r;
      }
    }
    if (k == 0) first = most;
    if (!(most > 1e-12 * first)) return k;
    chosen.push_back(uint32_t(best));
    const std::array<double, 6> unit = rows[best];
    for (std::array<double, 6> &row : rows) {
      double along = 0;
      for (size_t a = 0; a < 6; ++a) along += row[a] * unit[a];
      for (size_t a = 0; a < 6; ++a) row[a] -= along / most * unit[a];
    }
  }
  return 6;
}

// The rows of points' components, lengths in `extent`.
void add_rows(const double *x, double extent, uint8_t bits, uint32_t point,
              std::vector<std::array<double, 6>> &rows, std::vector<uint32_t> &which) {
  double scaled[3], g[3][6];
  for (int a = 0; a < 3; ++a) scaled[a] = x[a] / extent;
  rigid_rows(scaled, g);
  for (uint32_t a = 0; a < 3; ++a) {
    if (!(bits >> a & 1)) continue;
    rows.emplace_back();
    std::copy(g[a], g[a] + 6, rows.back().begin());
    which.push_back(3 * point + a);
  }
}

const Kernels *choose_kernels(const dfm_host *host, const char *id) {
  const model::Width width = model::choose_width(host, id);
  if constexpr (model::kHasWider) {
    if (width != model::kSse2) return width == model::kAvx512 ? kernels_avx512() : kernels_avx2();
  }
  return kernels_sse2();
}

}  // namespace

model::Lame Elastic::lame(uint32_t c) const {
  return model::lame_of(field_[kYoung].empty() ? young_ : field_[kYoung][c],
                        field_[kPoisson].empty() ? poisson_ : field_[kPoisson][c]);
}

void Elastic::take(const dfm_mesh &m, const char *id) {
  npoint = m.npoint;
  ncell = m.ncell;
  if (npoint > kMaxPoints) {
    model::refuse(host_, id,
                  "%u points; more than %u are refused, because their factor and modes take minutes; take a "
                  "coarser mesh, which a fine surface may hang on, or corotational_fem",
                  npoint, kMaxPoints);
  }
  young_ = m.params[kYoung];
  poisson_ = m.params[kPoisson];
  model::take_fields(host_, id, kParams, kParamCount, m, field_, [](uint32_t, double) { return true; });
  rest.create(host_, 3 * size_t(npoint));
  mass.create_copy(host_, m.mass, npoint);
  held.create(host_, npoint);
  work_.create(host_, 3 * size_t(npoint));
  nodes_ = model::nodes_of(m.cell);
  cells_.create_copy(host_, m.cells, nodes_ * size_t(ncell));
  turns = true;
  for (uint32_t i = 0; i < npoint; ++i) {
    if (!(mass[i] > 0)) throw "a point has no mass; every point must belong to a cell";
    total += mass[i];
    held[i] = m.fixed ? m.fixed[i] & 7 : 0;
    if (!held[i]) continue;
    holders.push_back(i);
    turns = turns && held[i] == 7;
  }
  floating = holders.empty();
  turns = turns && !floating;
  if (holders.size() == npoint && turns) throw "all points are held: nothing is left to move";
}

// The center of mass; of points held in all components; else that of the mesh's coordinates.
void Elastic::place_origin(const dfm_mesh &m) {
  double sum = 0;
  const auto add = [&](uint32_t i, double weight) {
    for (size_t a = 0; a < 3; ++a) origin[a] += weight * m.rest[3 * size_t(i) + a];
    sum += weight;
  };
  if (floating)
    for (uint32_t i = 0; i < npoint; ++i) add(i, mass[i]);
  else if (turns)
    for (const uint32_t i : holders) add(i, 1);
  for (size_t a = 0; a < 3 && sum > 0; ++a) origin[a] /= sum;
  for (size_t i = 0; i < npoint; ++i)
    for (size_t a = 0; a < 3; ++a) {
      rest[3 * i + a] = m.rest[3 * i + a] - origin[a];
      extent = std::max(extent, std::fabs(rest[3 * i + a] - rest[a]));
    }
}

// Volumes and mean gradients; the stiffness too, if it is that of the cells.
void Elastic::take_cells(const dfm_mesh &m) {
  volume_.create(host_, ncell);
  mean_.create(host_, 3 * size_t(nodes_) * ncell);
  if (m.cell != DFM_CELL_TET) cell_block_.create(host_, m.cell, ncell);
  const bool part = m.size >= offsetof(dfm_mesh, inside) + sizeof m.inside && m.inside;
  for (size_t c = 0; c < ncell; ++c) {
    double x[3 * model::kMaxNodes];
    for (size_t a = 0; a < nodes_; ++a) std::copy_n(&rest[3 * size_t(cells_[nodes_ * c + a])], 3, x + 3 * a);
    model::RestCell made;
    const double *const inside = part ? m.inside + model::cells::kInside * c : nullptr;
    if (!model::make_rest_cell(m.cell, x, inside, {lame(uint32_t(c))}, made)) {
      if (m.cell == DFM_CELL_TET) continue;
      throw model::kFlatCell;
    }
    volume_[c] = made.volume;
    std::copy_n(made.mean[0], 3 * size_t(nodes_), &mean_[3 * nodes_ * c]);
    if (!cell_block_.block.empty()) cell_block_.set(uint32_t(c), made);
    if (!by_surface_) add_cell(uint32_t(c), made);
  }
}

void Elastic::add_cell(uint32_t c, const model::RestCell &cell) {
  const uint32_t *const q = cells_.data() + nodes_ * size_t(c);
  for (uint32_t a = 0; a < nodes_; ++a)
    for (uint32_t b = 0; b < nodes_; ++b) {
      if (q[a] > q[b]) continue;
      const size_t at = a == b ? q[a] : npoint + size_t(model::find_edge(edges_.data(), nedge_, q[a], q[b]));
      for (size_t r = 0; r < 3; ++r)
        for (size_t s = 0; s < 3; ++s) block_[9 * at + 3 * r + s] += cell.stiffness[3 * a + r][3 * b + s];
    }
}

// Orthonormal by mass.
void Elastic::find_rigid() {
  const size_t size = 3 * size_t(npoint);
  rigid.create(host_, 6 * size);
  for (size_t i = 0; i < npoint; ++i) {
    double g[3][6];
    rigid_rows(rest.data() + 3 * i, g);
    for (size_t k = 0; k < 6; ++k)
      for (size_t a = 0; a < 3; ++a) rigid[k * size + 3 * i + a] = g[a][k];
  }
  const auto product_of = [&](const double *a, const double *b) {
    double sum = 0;
    for (size_t j = 0; j < size; ++j) sum += mass[j / 3] * a[j] * b[j];
    return sum;
  };
  double *row[6];
  for (size_t k = 0; k < 6; ++k) row[k] = rigid.data() + k * size;
  orthonormalize(row, size, product_of);
}

// Finds three points far from each other.
void Elastic::find_pins() {
  const auto farthest = [&](const auto &measure) {
    uint32_t best = 0;
    double most = -1;
    for (uint32_t i = 0; i < npoint; ++i) {
      const double d = measure(rest.data() + 3 * size_t(i));
      if (d > most) {
        most = d;
        best = i;
      }
    }
    return best;
  };
  const auto square = [](const double *x, const double *y) {
    double sum = 0;
    for (int a = 0; a < 3; ++a) sum += (x[a] - y[a]) * (x[a] - y[a]);
    return sum;
  };
  const double zero[3] = {};
  const uint32_t first = farthest([&](const double *x) { return square(x, zero); });
  const double *const a = rest.data() + 3 * size_t(first);
  const uint32_t second = farthest([&](const double *x) { return square(x, a); });
  const double *const b = rest.data() + 3 * size_t(second);
  const uint32_t third = farthest([&](const double *x) {
    double d[3] = {}, e[3], f[3];
    for (int n = 0; n < 3; ++n) {
      e[n] = b[n] - a[n];
      f[n] = x[n] - a[n];
    }
    cross_add(e, f, 1, d);
    return square(d, zero);
  });
  std::vector<std::array<double, 6>> rows;
  std::vector<uint32_t> which, chosen;
  for (const uint32_t i : {first, second, third})
    add_rows(rest.data() + 3 * size_t(i), extent, 7, i, rows, which);
  if (independent_rows(std::move(rows), chosen) < 6) throw "the mesh has no volume";
  for (const uint32_t r : chosen) given_.push_back(which[r]);
}

void Elastic::check_holding(const char *id) const {
  std::vector<std::array<double, 6>> rows;
  std::vector<uint32_t> which, chosen;
  bool inside = false;
  for (const uint32_t i : holders)
    if (std::binary_search(surface_.inner.begin(), surface_.inner.end(), i)) inside = true;
    else add_rows(rest.data() + 3 * size_t(i), extent, held[i], i, rows, which);
  const bool enough = independent_rows(std::move(rows), chosen) == 6;
  constexpr const char *kInside =
      "points inside are held, but boundary elements are held by their surface alone; hold points of the "
      "surface";
  if (!enough && inside) throw kInside;
  if (!enough)
    throw "what is held leaves the body a rigid motion; hold three points that are not in a line, hold "
          "nothing, or use corotational_fem";
  if (inside) model::say(host_, 2, id, "%s", kInside);
}

// Given displacements have a row and a column of their own.
void Elastic::factorize() {
  std::vector<uint8_t> out(3 * size_t(npoint));
  for (const uint32_t j : given_) out[j] = 1;
  if (by_surface_) return surface_.factorize(*kernels, block_.data(), out);
  double mean = 0;
  for (size_t i = 0; i < npoint; ++i) mean += (block_[9 * i] + block_[9 * i + 4]) + block_[9 * i + 8];
  mean /= double(3 * size_t(npoint));
  std::vector<uint32_t> ij;
  for (uint32_t i = 0; i < npoint; ++i) ij.insert(ij.end(), {i, i});
  ij.insert(ij.end(), edges_.data(), edges_.data() + 2 * size_t(nedge_));
  std::vector<double> blk(block_.data(), block_.data() + 9 * (size_t(npoint) + nedge_));
  for (size_t b = 0; 2 * b < ij.size(); ++b)
    for (size_t r = 0; r < 3; ++r)
      for (size_t s = 0; s < 3; ++s)
        if (out[3 * size_t(ij[2 * b]) + r] || out[3 * size_t(ij[2 * b + 1]) + s])
          blk[9 * b + 3 * r + s] = b < npoint && r == s ? mean : 0;
  factor_.create(host_, npoint, ij, blk, rest.data());
}

// One material; the blocks are those of all pairs of the surface's points.
void Elastic::take_surface(const dfm_mesh &m, const char *id) {
  for (const uint32_t key : {kYoung, kPoisson})
    if (!field_[key].empty()) {
      model::refuse(
          host_, id,
          "%s differs by cell, and boundary elements have one material; give one value (for a surface "
          "\"fill\": {\"cells\": 0}), or take the model condensed",
          kParams[key].key);
    }
  edges_.create_copy(host_, surface_.edges.data(), surface_.edges.size());
  nedge_ = uint32_t(surface_.edges.size() / 2);
  std::vector<uint32_t>().swap(surface_.edges);  // 8 bytes a pair
}

void Elastic::create(const dfm_host *host, const char *id, const dfm_mesh &m, bool by_surface) {
  host_ = host;
  kernels = choose_kernels(host, id);
  by_surface_ = by_surface;
  take(m, id);
  if (by_surface) surface_.find(host, id, m);
  place_origin(m);
  if (by_surface) take_surface(m, id);
  else nedge_ = model::list_pairs(host, cells_.data(), ncell, nodes_, edges_);
  block_.create(host, 9 * (size_t(npoint) + nedge_));
  take_cells(m);
  if (by_surface) surface_.assemble(id, *kernels, rest.data(), young_, poisson_, block_.data());
  if (floating) {
    find_rigid();
    find_pins();
  } else {
    check_holding(id);
    for (uint32_t j = 0; j < 3 * npoint; ++j)
      if (is_held(j)) given_.push_back(j);
  }
  factorize();
  if (floating && !by_surface) block_.drop();
}

void Elastic::compliance(const double *f, double *u) const { respond<1>(f, u); }

void Elastic::compliance_of_eight(const double *f, double *u) const { respond<kLanes>(f, u); }

// Held bodies alone: of a floating one the inertia forces act at all points.
void Elastic::compliance_between(uint32_t n, const uint32_t *points, double *w) const {
  if (by_surface_) {
    const bool inside = !std::all_of(points, points + n, [&](uint32_t i) { return leads(i); });
    return responses_at(npoint, n, points, w, [&](double *eight) {
      if (inside) return compliance_of_eight(eight, eight);
      for (const uint32_t j : given_) std::fill_n(eight + kLanes * j, kLanes, 0.0);
      surface_.solve<kLanes>(eight);
      for (const uint32_t j : given_) std::fill_n(eight + kLanes * j, kLanes, 0.0);
    });
  }
  factor_.inverse_at(n, points, w);
  const size_t rows = 3 * size_t(n);
  const auto fixed = [&](size_t j) { return is_held(3 * size_t(points[j / 3]) + j % 3); };
  for (size_t i = 0; i < rows; ++i)
    for (size_t j = 0; j < rows; ++j)
      if (fixed(i) || fixed(j)) w[i * rows + j] = 0;
}

// Floating: to the force less the inertia forces of the rigid acceleration that it calls for, and without a
// rigid motion.
template <size_t kWide>
void Elastic::respond(const double *f, double *u) const {
  const size_t size = 3 * size_t(npoint);
  const auto clear_given = [&] {
    for (const uint32_t j : given_) std::fill_n(u + kWide * j, kWide, 0.0);
  };
  const auto solve = [&] {
    if (by_surface_) surface_.gather<kWide>(u);
    clear_given();
    if (by_surface_) {
      surface_.solve<kWide>(u);
      surface_.spread<kWide>(u);
      return clear_given();
    }
    if constexpr (kWide == 1) factor_.solve(u, u);
    else factor_.solve_eight(u, u);
  };
  std::copy(f, f + kWide * size, u);
  if (!floating) return solve();
  double along[6][kWide] = {};
  for (size_t k = 0; k < 6; ++k)
    for (size_t j = 0; j < size; ++j)
      for (size_t w = 0; w < kWide; ++w) along[k][w] += rigid[k * size + j] * f[kWide * j + w];
  for (size_t k = 0; k < 6; ++k)
    for (size_t j = 0; j < size; ++j)
      for (size_t w = 0; w < kWide; ++w) u[kWide * j + w] -= mass[j / 3] * along[k][w] * rigid[k * size + j];
  solve();
  for (size_t k = 0; k < 6; ++k)
    for (size_t w = 0; w < kWide; ++w) along[k][w] = 0;
  for (size_t k = 0; k < 6; ++k)
    for (size_t j = 0; j < size; ++j)
      for (size_t w = 0; w < kWide; ++w) along[k][w] += mass[j / 3] * rigid[k * size + j] * u[kWide * j + w];
  for (size_t k = 0; k < 6; ++k)
    for (size_t j = 0; j < size; ++j)
      for (size_t w = 0; w < kWide; ++w) u[kWide * j + w] -= along[k][w] * rigid[k * size + j];
}

// out += scale K u
void Elastic::multiply(const double *u, double scale, double *out) const {
  const auto take = [&](size_t i, size_t j, const double *k, bool transposed) {
    const size_t row = transposed ? 1 : 3, column = transposed ? 3 : 1;
    for (size_t r = 0; r < 3; ++r)
      for (size_t s = 0; s < 3; ++s) out[3 * i + r] += scale * k[row * r + column * s] * u[3 * j + s];
  };
  for (size_t i = 0; i < npoint; ++i) take(i, i, block_.data() + 9 * i, false);
  for (size_t e = 0; e < nedge_; ++e) {
    const size_t i = edges_[2 * e], j = edges_[2 * e + 1];
    take(i, j, block_.data() + 9 * (npoint + e), false);
    take(j, i, block_.data() + 9 * (npoint + e), true);
  }
}

// By surface in two passes: the factor of tiles is that of block_ to a tolerance.
void Elastic::follow(double *u) const {
  double *const f = work_.data();
  const size_t size = 3 * size_t(npoint);
  for (int pass = 0; pass < (by_surface_ ? 2 : 1); ++pass) {
    std::fill(f, f + size, 0.0);
    multiply(u, -1, f);
    for (const uint32_t j : given_) f[j] = 0;
    if (by_surface_) surface_.solve<1>(f);
    else factor_.solve(f, f);
    for (const uint32_t j : given_) f[j] = 0;
    for (size_t j = 0; j < size; ++j) u[j] += f[j];
  }
  lead(u);
}

void Elastic::lead(double *u) const {
  if (!by_surface_) return;
  for (const uint32_t i : surface_.inner) std::copy_n(u + 3 * size_t(i), 3, work_.data() + 3 * size_t(i));
  surface_.spread<1>(u);
  for (const uint32_t j : given_)
    if (!leads(j / 3)) u[j] = work_[j];
}

// h = sum u_a g_a^T
void Elastic::gradient(uint32_t c, const double *u, double *h) const {
  const uint32_t *const q = cells_.data() + nodes_ * size_t(c);
  const double *const g = mean_.data() + 3 * nodes_ * size_t(c);
  std::fill(h, h + 9, 0.0);
  for (size_t a = 1; a < nodes_; ++a)
    for (size_t r = 0; r < 3; ++r)
      for (size_t s = 0; s < 3; ++s)
        h[3 * r + s] += (u[3 * size_t(q[a]) + r] - u[3 * size_t(q[0]) + r]) * g[3 * a + s];
}

double Elastic::largest_gradient(const double *u, uint32_t *where) const {
  double most = 0, h[9];
  for (uint32_t c = 0; c < ncell; ++c) {
    gradient(c, u, h);
    double square = 0;
    for (const double x : h) square += x * x;
    if (!(square > most)) continue;
    most = square;
    if (where) *where = c;
  }
  return std::sqrt(most);
}

void Elastic::stress(uint32_t c, const double *u, double *out) const {
  double h[9];
  gradient(c, u, h);
  const model::Lame m = lame(c);
  const double pressure = m.lambda * ((h[0] + h[4]) + h[8]);
  for (size_t r = 0; r < 3; ++r)
    for (size_t s = 0; s < 3; ++s)
      out[3 * r + s] = m.mu * (h[3 * r + s] + h[3 * s + r]) + (r == s ? pressure : 0);
}

double Elastic::energy(const double *u) const {
  double sum = 0;
  if (by_surface_) {
    double *const f = work_.data();
    std::fill(f, f + 3 * size_t(npoint), 0.0);
    multiply(u, 1, f);
    for (size_t j = 0; j < 3 * size_t(npoint); ++j) sum += 0.5 * f[j] * u[j];
  } else {
    for (uint32_t c = 0; c < ncell; ++c) sum += volume(c) * density(c, u);
  }
  return sum;
}

size_t Elastic::nmoving() const {
  size_t moving = 0;
  for (size_t j = 0; j < 3 * size_t(npoint); ++j) moving += !is_held(j);
  for (const uint32_t i : surface_.inner)
    for (size_t a = 0; a < 3; ++a) moving -= !is_held(3 * size_t(i) + a);
  return floating ? moving - 6 : moving;
}

double Elastic::density(uint32_t c, const double *u) const {
  if (!(volume_[c] > 0)) return 0;
  if (!cell_block_.block.empty()) {
    double own[model::kMaxNodes][3], force[model::kMaxNodes][3];
    for (uint32_t a = 0; a < nodes_; ++a)
      std::copy_n(u + 3 * size_t(cells_[nodes_ * size_t(c) + a]), 3, own[a]);
    return cell_block_.energy(c, own, force) / volume_[c];
  }
  double h[9], s[9], sum = 0;
  gradient(c, u, h);
  stress(c, u, s);
  for (size_t n = 0; n < 9; ++n) sum += s[n] * h[n];
  return 0.5 * sum;
}

}  // namespace reduced
