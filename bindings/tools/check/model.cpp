#include "check/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <numeric>
#include <set>

#include "mesh/cells.h"
#include "slots.h"

namespace cli::check {
namespace {

constexpr double kDensity = 1000;  // kg/m3

void cross(const double *a, const double *b, double *out) {
  for (int k = 0; k < 3; ++k) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

size_t state_size(const std::vector<dfm_slot> &slots, const Solid &solid) {
  const std::map<uint32_t, size_t> count = {{DFM_PER_POINT, solid.npoint()},
                                            {DFM_PER_CELL, solid.ncell()},
                                            {DFM_PER_EDGE, solid.nedge()},
                                            {DFM_PER_INSTANCE, 1}};
  size_t total = 0;
  for (const dfm_slot &slot : slots) {
    const auto unit = count.find(slot.unit);
    total += unit == count.end() ? 0 : unit->second * slot.width;
  }
  return total;
}

void couple(Solid &out) {
  out.row = {0};
  const auto surfel = [&](std::initializer_list<std::pair<uint32_t, double>> points) {
    for (const auto &[i, w] : points) {
      out.col.push_back(i);
      out.weight.push_back(w);
    }
    out.row.push_back(static_cast<uint32_t>(out.col.size()));
  };
  for (uint32_t i = 0; i < 12; ++i) {
    const uint32_t *const cell = &out.cells[4 * size_t(i) * (out.ncell() / 12)];
    surfel({{i * (out.npoint() / 12), 1.0}});
    surfel({{cell[0], 0.5}, {cell[1], 0.3}, {cell[2], 0.2}});
  }
}

}  // namespace

double length(const double *a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

double largest(std::span<const double> f) {
  double most = 0;
  for (const double a : f) most = std::max(most, std::fabs(a));
  return most;
}

double most_apart(std::span<const double> a, std::span<const double> b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

bool below(const std::vector<double> &m, size_t width, double shift) {
  std::vector<double> l(width * width, 0.0);
  for (size_t r = 0; r < width; ++r)
    for (size_t c = 0; c <= r; ++c) {
      double sum = (r == c ? shift : 0) - m[r * width + c];
      for (size_t k = 0; k < c; ++k) sum -= l[r * width + k] * l[c * width + k];
      if (r == c && !(sum > 0)) return false;
      l[r * width + c] = r == c ? std::sqrt(sum) : sum / l[c * width + c];
    }
  return true;
}

std::string with(const Variant &variant) { return "with " + variant.name; }

uint32_t Solid::nodes() const { return dfm::cell_kind(cell).nodes; }

double Solid::volume(uint32_t c) const {
  const uint32_t *const q = &cells[nodes() * size_t(c)];
  if (cell == DFM_CELL_TET || cell == DFM_CELL_TET10) return dfm::tet_volume(rest.data(), q);
  // a bilinear face halves what is between its two pairs of triangles
  constexpr uint32_t kFace[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                    {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  double sum = 0;
  for (const auto &f : kFace)
    for (const auto &[i, j, k] : {std::array{0, 1, 2}, {0, 2, 3}, {0, 1, 3}, {1, 2, 3}}) {
      const uint32_t tet[4] = {q[0], q[f[i]], q[f[j]], q[f[k]]};
      sum += dfm::tet_volume(rest.data(), tet) / 2;
    }
  return sum;
}

void Solid::find_properties(Held held) {
  const size_t n = rest.size() / 3;
  mass.assign(n, 0.0);
  fixed.assign(n, 0);
  for (size_t i = 0; i < n && held == Held::one_side; ++i)
    if (rest[3 * i] < kCube / 4) fixed[i] = 7;
  for (uint32_t c = 0; c < ncell(); ++c) {
    const uint32_t *const q = &cells[nodes() * size_t(c)];
    double share[dfm::kMaxNodes];
    dfm::mass_shares(dfm::cell_kind(cell), rest.data(), q, share);
    for (uint32_t k = 0; k < nodes(); ++k) mass[q[k]] += kDensity * volume(c) * share[k];
  }
  find_edges();
}

void Solid::find_edges() {
  const dfm::Array<uint32_t> all = dfm::unique_edges(
      dfm::tets_of(dfm::Memory::standard(), dfm::cell_kind(cell), {cells.begin(), cells.end()}));
  edges.assign(all.begin(), all.end());
}

Solid block(uint32_t nx, uint32_t ny, uint32_t nz, Held held) {
  Solid out;
  Random random(11);
  const auto number = [&](uint32_t x, uint32_t y, uint32_t z) { return (z * (ny + 1) + y) * (nx + 1) + x; };
  for (uint32_t z = 0; z <= nz; ++z)
    for (uint32_t y = 0; y <= ny; ++y)
      for (uint32_t x = 0; x <= nx; ++x) {
        for (const uint32_t a : {x, y, z}) out.rest.push_back(kCube * (a + random.uniform(-0.1, 0.1)));
      }
  // a cube as six tetrahedra around its diagonal: from one corner to the other along the axes, in each order
  constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (uint32_t z = 0; z < nz; ++z)
    for (uint32_t y = 0; y < ny; ++y)
      for (uint32_t x = 0; x < nx; ++x)
        for (const auto &order : kOrders) {
          uint32_t at[3] = {x, y, z};
          out.cells.push_back(number(x, y, z));
          for (const int axis : order) {
            ++at[axis];
            out.cells.push_back(number(at[0], at[1], at[2]));
          }
        }
  for (size_t c = 0; c < out.cells.size(); c += 4)
    if (dfm::tet_volume(out.rest.data(), &out.cells[c]) < 0) std::swap(out.cells[c + 2], out.cells[c + 3]);
  out.find_properties(held);
  couple(out);
  return out;
}

Solid with_cells(const Solid &of, uint32_t cell) {
  if (of.cell == cell) return of;
  const bool tetrahedra = cell == DFM_CELL_TET10;
  dfm::RestMesh mesh;
  mesh.points = {of.rest.begin(), of.rest.end()};
  for (uint32_t c = 0; c < of.ncell(); c += 6) {  // the first three go along x y, y z and z x
    const uint32_t *const q = &of.cells[4 * size_t(c)];
    if (tetrahedra) mesh.tets.insert(mesh.tets.end(), q, q + 24);
    else
      for (const uint32_t k : {0, 1, 2, 5, 9, 10, 3, 6}) mesh.cells.push_back(q[k]);
  }
  if (!tetrahedra) {
    mesh.cell = DFM_CELL_HEX8;
    mesh.tets = dfm::tets_of(*mesh.memory, dfm::cell_kind(DFM_CELL_HEX8), mesh.cells);
  }
  mesh.tet_group.assign(mesh.ntet(), dfm::kNoGroup);
  mesh.file_point.resize(mesh.npoint());
  if (cell != DFM_CELL_HEX8) mesh = dfm::second_order(mesh);
  const size_t nodes = dfm::cell_kind(cell).nodes, given = dfm::cell_kind(mesh.cell).nodes;
  Solid out = of;
  out.cell = cell;
  out.cells.clear();
  std::vector<uint32_t> to(mesh.npoint(), UINT32_MAX);  // middles of faces are left out of 20 points
  std::iota(to.begin(), to.begin() + of.npoint(), 0u);
  for (size_t n = 0; n < mesh.cells.size(); ++n) {
    const uint32_t i = mesh.cells[n];
    if (n % given >= nodes) continue;
    if (to[i] == UINT32_MAX) {
      to[i] = static_cast<uint32_t>(out.rest.size() / 3);
      out.rest.insert(out.rest.end(), &mesh.points[3 * size_t(i)], &mesh.points[3 * size_t(i)] + 3);
    }
    out.cells.push_back(to[i]);
  }
  out.find_properties(of.fixed[0] ? Held::one_side : Held::nothing);
  return out;
}

Solid small_block(uint32_t cell, Held held) {
  return block(3, 3, cell == DFM_CELL_TET || cell == DFM_CELL_HEX8 ? 2 : 1, held);
}

const dfm_model &model_of(const Subject &subject) {
  return *static_cast<const dfm_model *>(subject.type->ops);
}

namespace {

std::vector<const dfm::CellKind *> kinds_of(const Subject &subject) {
  std::vector<const dfm::CellKind *> out;
  for (const dfm::CellKind &kind : dfm::cell_kinds())
    if (model_of(subject).cells & kind.kind) out.push_back(&kind);
  return out;
}

}  // namespace

bool takes_solids(const Subject &subject) { return !kinds_of(subject).empty(); }

Variant defaults_of(const Subject &subject) {
  if (!takes_solids(subject))
    skip("the model accepts no cells with a volume, of which all meshes of this check consist");
  return {"the defaults", default_params(*subject.type), kinds_of(subject)[0]->kind};
}

std::vector<Variant> variants(const Subject &subject) {
  const dfm_type &type = *subject.type;
  const Variant defaults = defaults_of(subject);
  std::vector<Variant> wanted = {defaults};
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += std::clamp(type.params[i].width, 1u, 16u), ++i) {
    const dfm_param &row = type.params[i];
    const auto add = [&](const std::string &name, double value) {
      wanted.push_back({std::string(row.key) + " = " + name, defaults.params, defaults.cell});
      wanted.back().params[at] = value;
    };
    if (std::strcmp(row.key, "damping_stiffness") == 0 && row.def == 0 && row.max >= 1e-3) add("1e-3", 1e-3);
    for (uint32_t k = 0; (row.flags & DFM_PARAM_ENUM) && row.names && row.names[k]; ++k)
      if (k != row.def) add(row.names[k], k);
  }
  const size_t n = std::min<size_t>(wanted.size(), 2);
  for (const dfm::CellKind *kind : kinds_of(subject))
    for (size_t k = 0; kind->kind != defaults.cell && k < n; ++k)
      if (k == 0 || wanted[k].name.starts_with("damping_stiffness"))
        wanted.push_back({wanted[k].name + " and " + kind->name, wanted[k].params, kind->kind});
  std::vector<Variant> out;
  const Solid solid = block(1, 1, 1);
  for (Variant &v : wanted) {
    stage("create with %s", v.name.c_str());
    const Body body(subject, solid, v, 4,
                    out.empty() ? Body::Refusal::is_broken : Body::Refusal::is_reported);
    if (body.made()) out.push_back(std::move(v));
  }
  return out;
}

Body::Body(const Subject &s, const Solid &of, const Variant &variant, uint32_t width, Refusal refusal)
    : subject(s),
      solid(with_cells(of, variant.cell)),
      params(variant.params),
      ops(model_of(s)),
      stride(width) {
  dfm_mesh m{};
  const char *const no_key = nullptr;
  const double *const no_field = nullptr;
  m.size = sizeof m;
  m.npoint = solid.npoint();
  m.ncell = solid.ncell();
  m.cell = solid.cell;
  m.rest = solid.rest.data();
  m.cells = solid.cells.data();
  m.mass = solid.mass.data();
  m.params = params.data();
  m.field_keys = &no_key;
  m.fields = &no_field;
  m.nedge = solid.nedge();
  m.nsurfel = solid.nsurfel();
  m.edges = solid.edges.data();
  m.row = solid.row.data();
  m.col = solid.col.data();
  m.weight = solid.weight.data();
  m.fixed = solid.fixed.data();
  const dfm_host &host = s.plugin->host().table();
  const size_t said = s.plugin->host().said().size();
  if (call("create", [&] { return ops.create(&host, &m, &self); }) != DFM_OK) self = nullptr;
  why_ = s.plugin->host().said().substr(said);
  if (why_.rfind("; ", 0) == 0) why_.erase(0, 2);
  if (!self && refusal == Refusal::is_broken)
    broken(
        "create refuses a block of %u cells with %s (%s); accept every mesh of cells that "
        "dfm_model.cells names, or refuse the parameters for all",
        solid.ncell(), variant.name.c_str(), why_.empty() ? "without a reason" : why_.c_str());
  if (!self) return;
  stepper = static_cast<const dfm_stepper *>(extension("dfm.stepper/1"));
  if (stepper && stepper->size < offsetof(dfm_stepper, commit) + sizeof(void *)) stepper = nullptr;  // V03
  caps = ops.caps;  // V03 says which of them lack their functions
  if (!ops.energy) caps &= ~uint32_t(DFM_CAP_ENERGY);
  if (!ops.pattern || !ops.stiffness) caps &= ~uint32_t(DFM_CAP_STIFFNESS | DFM_CAP_CONSTANT_STIFFNESS);
  if (const auto *claims = static_cast<const dfm_caps *>(extension(DFM_EXT_CAPS)); claims && claims->active)
    caps &= claims->active(self);
  const auto own = slot_rows(static_cast<const dfm_slots *>(extension(DFM_EXT_SLOTS)));
  state.assign(state_size(own ? *own : slot_rows(ops.slots, ops.nslot, ops.slot_size), solid), 0.0);
  if (!state.empty() && ops.state_init)
    must("state_init", [&] { return ops.state_init(self, state.data()); });
  x.assign(size_t(stride) * points(), 0.0);
  v = x;
  for (uint32_t i = 0; i < points(); ++i) std::copy_n(&solid.rest[3 * size_t(i)], 3, at(x, i));
}

Body::~Body() {
  const Kept kept("destroy");
  if (self) ops.destroy(self);
}

const void *Body::extension(const char *id) const {
  const Kept kept("extension");
  return ops.extension ? ops.extension(self, id) : nullptr;
}

void Body::refused(const char *name, dfm_status status) const {
  broken("%s returns %s at a state of a body that moves; return finite values for every finite state", name,
         dfm_status_name(status));
}

std::vector<uint32_t> Body::surfels() const {
  std::vector<uint32_t> out(solid.nsurfel());
  std::iota(out.begin(), out.end(), 0u);
  return out;
}

dfm_kin Body::kin() const {
  dfm_kin k{};
  k.size = sizeof k;
  k.stride = stride;
  k.t = t;
  k.dt = dt;
  k.x = x.data();
  k.v = v.data();
  k.state = state.empty() ? nullptr : state.data();
  return k;
}

Numbers Body::forces() const {
  Numbers f(size_t(stride) * points(), 0.0);
  const dfm_kin k = kin();
  must("add_forces", [&] { return ops.add_forces(self, &k, f.data()); });
  return f;
}

double Body::energy() const {
  double joule = 0;
  const dfm_kin k = kin();
  must("energy", [&] { return ops.energy(self, &k, &joule); });
  return joule;
}

std::vector<double> Body::stiffness(double a, double b) const {
  uint32_t n = 0;
  must("pattern", [&] { return ops.pattern(self, &n, nullptr); });
  std::vector<uint32_t> ij(2 * size_t(n));
  must("pattern", [&] { return ops.pattern(self, &n, ij.data()); });
  std::set<std::pair<uint32_t, uint32_t>> seen;
  for (uint32_t e = 0; e < n; ++e) {
    const uint32_t i = ij[2 * size_t(e)], j = ij[2 * size_t(e) + 1];
    if (i > j || j >= points() || !seen.insert({i, j}).second)
      broken(
          "pair %u of its pattern is (%u, %u), which is out of order, listed twice or not a pair of points; "
          "list each pair once, i <= j",
          e, i, j);
  }
  Numbers blocks(9 * size_t(n), 0.0);
  const dfm_kin k = kin();
  must("stiffness", [&] { return ops.stiffness(self, &k, a, b, blocks.data()); });
  const size_t width = 3 * size_t(points());
  std::vector<double> out(width * width, 0.0);
  for (uint32_t e = 0; e < n; ++e)
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 3; ++c) {
        const size_t i = 3 * size_t(ij[2 * size_t(e)]) + r, j = 3 * size_t(ij[2 * size_t(e) + 1]) + c;
        out[i * width + j] = blocks[9 * size_t(e) + 3 * r + c];
        // the block (i, i) is given whole, and so says itself whether it is symmetric
        if (ij[2 * size_t(e)] != ij[2 * size_t(e) + 1]) out[j * width + i] = out[i * width + j];
      }
  return out;
}

double Body::longest_step() const {
  std::vector<double> ksum(points(), 0.0), csum(points(), 0.0);
  double h = 1e300;
  const dfm_kin k = kin();
  must("bound", [&] { return ops.bound(self, &k, ksum.data(), csum.data(), &h); });
  for (uint32_t i = 0; i < points(); ++i) {
    const double m = solid.mass[i], s = ksum[i], c = csum[i];
    if (!(s >= 0) || !(c >= 0) || !std::isfinite(s + c))
      broken(
          "bound returns row sums of %g N/m and %g N s/m for point %u; return finite sums that are not "
          "negative",
          s, c, i);
    if (s > 0) h = std::min(h, (-c + std::sqrt(c * c + 4 * m * s)) / s);
    else if (c > 0) h = std::min(h, 2 * m / c);
  }
  return h;
}

void Body::shake(double amount, double speed, Random &random) {
  for (uint32_t i = 0; i < points(); ++i)
    for (int a = 0; a < 3; ++a) {
      const double dx = random.uniform(-1, 1), dv = random.uniform(-1, 1);
      if (solid.fixed[i]) continue;
      at(x, i)[a] += amount * dx;
      at(v, i)[a] += speed * dv;
    }
}

void Body::turn(const double *axis, double angle, const double *shift) {
  for (uint32_t i = 0; i < points(); ++i) {
    double *const p = at(x, i), out[3], across[3];
    cross(axis, p, across);
    const double along = axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2];
    for (int a = 0; a < 3; ++a)
      out[a] = std::cos(angle) * p[a] + std::sin(angle) * across[a] +
               (1 - std::cos(angle)) * along * axis[a] + shift[a];
    std::copy_n(out, 3, p);
  }
}

std::vector<double> Body::predict(const Numbers &load) {
  std::vector<double> u(3 * size_t(solid.nsurfel()), 0.0);
  const dfm_kin k = kin();
  must("predict", [&] { return stepper->predict(self, &k, load.data(), u.data()); });
  return u;
}

std::vector<double> Body::respond(const std::vector<uint32_t> &surfels, const std::vector<double> &p) const {
  std::vector<double> du(3 * surfels.size(), 0.0);
  const dfm_kin k = kin();
  const uint32_t n = static_cast<uint32_t>(surfels.size());
  must("respond", [&] { return stepper->respond(self, &k, n, surfels.data(), p.data(), du.data()); });
  return du;
}

void Body::commit(const std::vector<double> &p) {
  Numbers x_end = x, v_end = v;
  std::vector<double> next = state;
  dfm_kin k = kin();
  k.state_out = state.empty() ? nullptr : next.data();
  must("commit", [&] { return stepper->commit(self, &k, p.data(), x_end.data(), v_end.data()); });
  x.swap(x_end);
  v.swap(v_end);
  state.swap(next);
  t += dt;
}

void Body::advance(double h) {
  dt = h;
  if (stepper) {
    predict(Numbers(x.size(), 0.0));
    return commit(std::vector<double>(3 * size_t(solid.nsurfel()), 0.0));
  }
  Numbers f(x.size(), 0.0);
  std::vector<double> next = state;
  dfm_kin k = kin();
  k.state_out = state.empty() ? nullptr : next.data();
  must("add_forces", [&] { return ops.add_forces(self, &k, f.data()); });
  state.swap(next);
  for (uint32_t i = 0; i < points(); ++i)
    for (int a = 0; a < 3 && !solid.fixed[i]; ++a) {
      at(v, i)[a] += h / solid.mass[i] * at(f, i)[a];
      at(x, i)[a] += h * at(v, i)[a];
    }
  t += h;
}

}  // namespace cli::check
