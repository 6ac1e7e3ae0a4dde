// A host of a page for model plugins: services, meshes, an instance with its arrays. Sees deform/plugin.h and
// its draft alone, as a third party's host would; the direct solver that it offers is the library's.
#pragma once
#include <deform/base.h>
#include <deform/plugin.h>
#include <deform/plugin_draft.h>
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "support.h"
#include "vec.h"

namespace model_test {

using test::cross;
using test::dot;
using test::norm;
using test::Vec;
inline Vec operator+(Vec a, Vec b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vec operator-(Vec a, Vec b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec operator*(double s, Vec a) { return {s * a[0], s * a[1], s * a[2]}; }

// What stays as it is behind the end of each allocation.
constexpr size_t kBehind = 256;
constexpr char kUntouched = 0x5a;

inline const void *library_solver() {
  static const void *given = nullptr;
  if (given) return given;
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_SOURCE_DIR;  // has none
  dfm_context *context = nullptr;
  EXPECT_EQ(dfm_context_create(&def, &context), DFM_OK);
  const dfm_plugin_fn ask = [](const dfm_host *host, uint32_t, uint32_t) -> const dfm_plugin * {
    given = host->extension(host->ctx, DFM_HOST_DIRECT);
    return nullptr;
  };
  EXPECT_EQ(dfm_plugin_register_static(context, ask, "ask"), DFM_E_UNSUPPORTED);
  dfm_context_destroy(context);
  return given;
}

// Services. `shuffle` > 0: parallel_for hands out its pieces in a random cut and order.
struct Host {
  dfm_host table{};
  unsigned shuffle = 0;
  size_t live = 0, peak = 0, calls = 0, fail_at = ~size_t(0);
  std::string logged;

  Host() {
    table.size = sizeof table;
    table.abi = DFM_ABI;
    table.abi_draft = DFM_ABI_DRAFT;
    table.ctx = this;
    table.alloc = [](void *c, size_t bytes, size_t align) -> void * {
      Host &h = *static_cast<Host *>(c);
      if (h.calls++ == h.fail_at) return nullptr;
      h.live += bytes;
      h.peak = std::max(h.peak, h.live);
      void *p = std::aligned_alloc(align, (bytes + kBehind + align - 1) / align * align);
      std::memset(static_cast<char *>(p) + bytes, kUntouched, kBehind);
      return p;
    };
    table.release = [](void *c, void *p, size_t bytes, size_t) {
      static_cast<Host *>(c)->live -= bytes;
      const char *behind = static_cast<char *>(p) + bytes;
      EXPECT_TRUE(std::all_of(behind, behind + kBehind, [](char b) { return b == kUntouched; }))
          << "written behind the end of " << bytes << " bytes";
      std::free(p);
    };
    table.log = [](void *c, int32_t, uint32_t, const char *text) {
      static_cast<Host *>(c)->logged += std::string(text) + "\n";
    };
    table.parallel_for = [](void *c, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t),
                            void *user) {
      Host &h = *static_cast<Host *>(c);
      if (!h.shuffle) return fn(user, 0, n);
      std::mt19937 random(h.shuffle++);
      std::vector<std::pair<uint32_t, uint32_t>> pieces;
      for (uint32_t at = 0; at < n;) {
        const uint32_t end = std::min<uint32_t>(n, at + grain * (1 + random() % 3));
        pieces.push_back({at, end});
        at = end;
      }
      std::shuffle(pieces.begin(), pieces.end(), random);
      for (auto [b, e] : pieces) fn(user, b, e);
    };
    table.extension = [](void *, const char *id) {
      return std::strcmp(id, DFM_HOST_DIRECT) == 0 ? library_solver() : nullptr;
    };
  }
};

// A type of a model's module: the one, or the n-th.
inline const dfm_type &type_of(const char *module, uint32_t n = 0) {
  static Host host;
  const std::string path = std::string(DEFORM_PLUGIN_DIR "/") + module + ".so";
  void *opened = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  EXPECT_NE(opened, nullptr) << dlerror();
  auto entry = reinterpret_cast<dfm_plugin_fn>(dlsym(opened, "dfm_plugin_entry"));
  return *entry(&host.table, DFM_ABI, DFM_ABI)->types[n];
}

struct Mesh {
  uint32_t kind = DFM_CELL_TET;
  std::vector<double> rest, mass, inside;  // inside: of hexahedra in part material
  std::vector<uint32_t> cells, edges;
  uint32_t nodes() const {
    return kind == DFM_CELL_HEX27   ? 27
           : kind == DFM_CELL_HEX20 ? 20
           : kind == DFM_CELL_TET10 ? 10
           : kind == DFM_CELL_HEX8  ? 8
                                    : 4;
  }
  uint32_t npoint() const { return uint32_t(rest.size() / 3); }
  uint32_t ncell() const { return uint32_t(cells.size() / nodes()); }
  Vec at(uint32_t i) const { return {rest[3 * i], rest[3 * i + 1], rest[3 * i + 2]}; }
  double volume(uint32_t c) const {
    const uint32_t *q = &cells[4 * c];
    return dot(at(q[1]) - at(q[0]), cross(at(q[2]) - at(q[0]), at(q[3]) - at(q[0]))) / 6;
  }
  void finish(double density = 1000) {
    std::set<std::pair<uint32_t, uint32_t>> set;
    mass.assign(npoint(), 0);
    for (uint32_t c = 0; c < ncell(); ++c)
      for (int a = 0; a < 4; ++a) {
        mass[cells[4 * c + a]] += density * std::abs(volume(c)) / 4;
        for (int b = 0; b < a; ++b) set.insert(std::minmax(cells[4 * c + a], cells[4 * c + b]));
      }
    edges.clear();
    for (auto [i, j] : set) {
      edges.push_back(i);
      edges.push_back(j);
    }
  }
};

// As a host describes it; fields, coupling and what is held are left out.
inline dfm_mesh described(const Mesh &m) {
  dfm_mesh d{};
  d.size = sizeof d;
  d.npoint = m.npoint();
  d.ncell = m.ncell();
  d.cell = m.kind;
  d.rest = m.rest.data();
  d.cells = m.cells.data();
  d.mass = m.mass.data();
  d.nedge = uint32_t(m.edges.size() / 2);
  d.edges = m.edges.data();
  if (!m.inside.empty()) d.inside = m.inside.data();
  return d;
}

// One tetrahedron of unit edges, or an irregular one.
inline Mesh regular_tet() {
  Mesh m;
  m.rest = {0, 0, 0, 1, 0, 0, 0.5, std::sqrt(0.75), 0, 0.5, std::sqrt(1.0 / 12), std::sqrt(2.0 / 3)};
  m.cells = {0, 1, 2, 3};
  m.finish();
  return m;
}
inline Mesh irregular_tet() {
  Mesh m;
  m.rest = {0.1, -0.2, 0.05, 1.2, 0.1, -0.1, 0.3, 0.9, 0.2, 0.2, 0.3, 0.7};
  m.cells = {0, 1, 2, 3};
  m.finish();
  return m;
}

// Bar of nx x ny x nz cubes of side h, six Kuhn tetrahedra each; `noise` moves inner points by
// that share of h.
inline Mesh kuhn_bar(uint32_t nx, uint32_t ny, uint32_t nz, double h, double noise = 0) {
  Mesh m;
  const auto id = [&](uint32_t i, uint32_t j, uint32_t k) { return (i * (ny + 1) + j) * (nz + 1) + k; };
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-noise * h, noise * h);
  for (uint32_t i = 0; i <= nx; ++i)
    for (uint32_t j = 0; j <= ny; ++j)
      for (uint32_t k = 0; k <= nz; ++k) {
        const bool inner = i > 0 && j > 0 && k > 0 && i < nx && j < ny && k < nz;
        for (uint32_t n : {i, j, k}) m.rest.push_back(h * n + (inner ? u(random) : 0));
      }
  for (uint32_t i = 0; i < nx; ++i)
    for (uint32_t j = 0; j < ny; ++j)
      for (uint32_t k = 0; k < nz; ++k) {
        int axes[3] = {0, 1, 2};
        do {
          uint32_t q[3] = {i, j, k};
          const size_t begin = m.cells.size();
          m.cells.push_back(id(q[0], q[1], q[2]));
          for (int a : axes) {
            ++q[a];
            m.cells.push_back(id(q[0], q[1], q[2]));
          }
          if (m.volume(uint32_t(begin / 4)) < 0) std::swap(m.cells[begin], m.cells[begin + 1]);
        } while (std::next_permutation(axes, axes + 3));
      }
  m.finish();
  return m;
}

// Points and tetrahedra of an MSH file, 2.2 or 4.1, text or binary.
inline Mesh read_msh(const std::string &path) {
  Mesh m;
  std::ifstream in(path, std::ios::binary);
  std::string word;
  bool binary = false;
  double version = 0;
  std::map<size_t, uint32_t> number;
  const auto get = [&](auto &...value) {
    if (binary) (in.read(reinterpret_cast<char *>(&value), sizeof value), ...);
    else (in >> ... >> value);
  };
  const auto point = [&](size_t tag) {
    Vec x;
    get(x[0], x[1], x[2]);
    number[tag] = m.npoint();
    m.rest.insert(m.rest.end(), x.begin(), x.end());
  };
  const auto cell = [&](int type, auto node) {  // type: 1 line, 2 triangle, 4 tetrahedron, 15 point
    for (int k = 0; k < (type == 4 ? 4 : type == 2 ? 3 : type == 1 ? 2 : 1); ++k) {
      get(node);
      if (type == 4) m.cells.push_back(number.at(size_t(node)));
    }
  };
  while (in >> word) {
    int entity[3], id, skip;
    size_t blocks, count, lowest, highest, tag;
    if (word == "$MeshFormat") {
      in >> version >> skip >> id;
      binary = skip == 1;
    } else if (version > 4 && (word == "$Nodes" || word == "$Elements")) {
      in.ignore(1);
      get(blocks, count, lowest, highest);
      for (size_t b = 0; b < blocks; ++b) {
        get(entity[0], entity[1], entity[2], count);  // dimension, tag, parametric or type
        std::vector<size_t> tags(word == "$Nodes" ? count : 0);
        for (size_t &t : tags) get(t);
        for (size_t t : tags) point(t);
        for (size_t e = 0; word == "$Elements" && e < count; ++e) {
          get(tag);
          cell(entity[2], tag);
        }
      }
    } else if (word == "$Nodes") {
      in >> count;
      in.ignore(1);
      for (size_t n = 0; n < count; ++n) {
        get(id);
        point(size_t(id));
      }
    } else if (word == "$Elements") {
      in >> count;
      in.ignore(1);
      for (size_t e = 0; e < count;) {
        int type, many = 1, tags;
        if (binary) get(type, many, tags);
        else in >> id >> type >> tags;
        for (int c = 0; c < many; ++c, ++e) {
          if (binary) get(id);
          for (int t = 0; t < tags; ++t) get(skip);
          cell(type, id);
        }
      }
    }
  }
  m.finish();
  return m;
}

using Fields = std::map<std::string, std::vector<double>>;

// Each point is a surfel; blended: each surfel hangs on three points.
struct Coupling {
  std::vector<uint32_t> row{0}, col;
  std::vector<double> weight;
  Coupling(uint32_t n, bool blended) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> u(0.1, 1);
    for (uint32_t i = 0; i < n; ++i) {
      const double a = u(random), b = u(random);
      for (uint32_t k = 0; k < (blended ? 3u : 1u); ++k) {
        col.push_back((i + 5 * k) % n);
        weight.push_back(!blended ? 1 : k == 0 ? a : k == 1 ? b * (1 - a) : (1 - b) * (1 - a));
      }
      row.push_back(uint32_t(col.size()));
    }
  }
};

// An instance with its point arrays. x starts at rest, v at zero.
struct ModelInstance {
  Host &host;
  Mesh mesh;
  Coupling coupling;
  uint32_t stride;
  const dfm_model *ops;
  void *self = nullptr;
  dfm_status status;
  std::vector<double> storage[3];
  double *x, *v, *f;
  std::vector<double> state, state_out;
  double dt = 1e-3, t = 0;

  ModelInstance(Host &h, const dfm_type &type, const Mesh &m, const std::vector<double> &params,
                uint32_t s = 4, const Fields &by_cell = {}, const std::vector<uint8_t> &fixed = {},
                bool blended = false)
      : host(h),
        mesh(m),
        coupling(m.npoint(), blended),
        stride(s),
        ops(static_cast<const dfm_model *>(type.ops)) {
    std::vector<const char *> keys;
    std::vector<const double *> fields;
    for (const auto &[key, values] : by_cell) {
      keys.push_back(key.c_str());
      fields.push_back(values.data());
    }
    keys.push_back(nullptr);
    dfm_mesh d = described(m);
    d.field_keys = keys.data();
    d.fields = fields.data();
    d.params = params.data();
    d.nsurfel = m.npoint();
    d.row = coupling.row.data();
    d.col = coupling.col.data();
    d.weight = coupling.weight.data();
    d.fixed = fixed.empty() ? nullptr : fixed.data();
    status = ops->create(&h.table, &d, &self);
    double **to[] = {&x, &v, &f};
    for (int n = 0; n < 3; ++n) {
      storage[n].assign(size_t(m.npoint()) * s + 8, 0);
      *to[n] = storage[n].data();
      while (reinterpret_cast<uintptr_t>(*to[n]) % 64) ++*to[n];
    }
    for (uint32_t i = 0; i < m.npoint(); ++i) set(x, i, m.at(i));
    if (status != DFM_OK) return;
    const auto *own = static_cast<const dfm_slots *>(ops->extension(self, DFM_EXT_SLOTS));
    const dfm_slot *slots = own ? own->slots : ops->slots;
    for (uint32_t n = 0; n < (own ? own->nslot : ops->nslot); ++n) {
      const uint32_t unit = slots[n].unit;
      const size_t count = unit == DFM_PER_EDGE    ? d.nedge
                           : unit == DFM_PER_CELL  ? d.ncell
                           : unit == DFM_PER_POINT ? d.npoint
                                                   : 1;
      state.resize(state.size() + slots[n].width * count);
    }
    if (ops->state_init) ops->state_init(self, state.data());
    state_out = state;
  }
  ~ModelInstance() { ops->destroy(self); }
  ModelInstance(const ModelInstance &) = delete;

  uint32_t size() const { return mesh.npoint(); }
  Vec get(const double *a, uint32_t i) const {
    return {a[size_t(stride) * i], a[size_t(stride) * i + 1], a[size_t(stride) * i + 2]};
  }
  void set(double *a, uint32_t i, Vec value) const {
    std::copy(value.begin(), value.end(), a + size_t(stride) * i);
  }
  dfm_kin kin() const {
    dfm_kin k{};
    k.size = sizeof k;
    k.stride = stride;
    k.x = x;
    k.v = v;
    k.t = t;
    k.dt = dt;
    k.state = state.empty() ? nullptr : state.data();
    return k;
  }
  // Forces of a step of length dt, whose end is then the present state.
  void forces_and_step() {
    std::fill(f, f + size_t(size()) * stride, 0.0);
    dfm_kin k = kin();
    k.state_out = state.empty() ? nullptr : state_out.data();
    EXPECT_EQ(ops->add_forces(self, &k, f), DFM_OK);
    state.swap(state_out);
  }
  void forces() {
    std::fill(f, f + size_t(size()) * stride, 0.0);
    const dfm_kin k = kin();
    EXPECT_EQ(ops->add_forces(self, &k, f), DFM_OK);
  }
  // Velocities by the forces, then positions by the velocities: symplectic Euler.
  void move(double h) {
    for (uint32_t i = 0; i < size(); ++i) {
      set(v, i, get(v, i) + (h / mesh.mass[i]) * get(f, i));
      set(x, i, get(x, i) + h * get(v, i));
    }
  }
  double energy() const {
    const dfm_kin k = kin();
    double joule = 0;
    EXPECT_EQ(ops->energy(self, &k, &joule), DFM_OK);
    return joule;
  }
  double largest_force() const {
    double most = 0;
    for (uint32_t i = 0; i < size(); ++i) most = std::max(most, norm(get(f, i)));
    return most;
  }
  // Row sums, and the step that a host takes from them: h^2 ksum + 2 h csum <= 4 m in every row.
  double bound(std::vector<double> *ksum = nullptr, std::vector<double> *csum = nullptr) const {
    std::vector<double> k(size(), 0), c(size(), 0);
    const dfm_kin at = kin();
    double h = 1e300;
    EXPECT_EQ(ops->bound(self, &at, k.data(), c.data(), &h), DFM_OK);
    for (uint32_t i = 0; i < size(); ++i)
      if (k[i] > 0) h = std::min(h, (-c[i] + std::sqrt(c[i] * c[i] + 4 * mesh.mass[i] * k[i])) / k[i]);
    if (ksum) *ksum = k;
    if (csum) *csum = c;
    return h;
  }
  void shake(double amount, double speed, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    for (uint32_t i = 0; i < size(); ++i) {
      set(x, i, get(x, i) + amount * Vec{u(random), u(random), u(random)});
      set(v, i, get(v, i) + speed * Vec{u(random), u(random), u(random)});
    }
  }
  // Some steps of flow back and forth, so that the plastic strain has axes of its own.
  void work(double amount) {
    const std::vector<double> start(x, x + 4 * size());
    for (unsigned seed = 1; seed < 4; ++seed) {
      std::copy(start.begin(), start.end(), x);
      shake(amount, 0, seed);
      forces_and_step();
    }
    std::copy(start.begin(), start.end(), x);
  }
};

// A body that `make` creates on a host, without each of its allocations in turn: out of memory is what it
// says, and nothing is left behind. Returns how many there are.
template <class Make>
size_t refuse_each_allocation(Make make) {
  size_t calls = 0;
  {
    Host host;
    {
      const auto body = make(host);
      EXPECT_EQ(body.status, DFM_OK) << host.logged;
      calls = host.calls;
    }
    EXPECT_EQ(host.live, 0u);
  }
  EXPECT_GT(calls, 0u);
  for (size_t n = 0; n < calls; ++n) {
    Host host;
    host.fail_at = n;
    const auto body = make(host);
    EXPECT_EQ(body.status, DFM_E_NOMEM) << n;
    EXPECT_EQ(host.live, 0u) << n;
  }
  return calls;
}

// J, from the energy per volume of each cell.
inline double energy_of_cells(ModelInstance &b) {
  const auto *ext = static_cast<const dfm_cell_energy *>(b.ops->extension(b.self, DFM_EXT_CELL_ENERGY));
  if (!ext) {
    ADD_FAILURE() << "no energy per cell";
    return 0;
  }
  std::vector<double> density(b.mesh.ncell());
  const dfm_kin k = b.kin();
  EXPECT_EQ(ext->cell_energy(b.self, &k, density.data()), DFM_OK);
  double sum = 0;
  for (uint32_t c = 0; c < b.mesh.ncell(); ++c) sum += density[c] * b.mesh.volume(c);
  return sum;
}

// Pa, [ncell,6].
inline std::vector<double> stress_of_cells(ModelInstance &b) {
  const auto *ext = static_cast<const dfm_cell_stress *>(b.ops->extension(b.self, DFM_EXT_CELL_STRESS));
  std::vector<double> stress(6 * size_t(b.mesh.ncell()));
  const dfm_kin k = b.kin();
  EXPECT_EQ(ext ? ext->cell_stress(b.self, &k, stress.data()) : DFM_E_UNSUPPORTED, DFM_OK);
  return stress;
}

constexpr int kStressRow[6] = {0, 1, 2, 0, 1, 2}, kStressColumn[6] = {0, 1, 2, 1, 2, 0};

// Central differences of the energy at every fifth point: 2 h^2 of its third derivative against its rounding
// over h. `scale` is the largest force.
inline void expect_force_is_gradient(ModelInstance &b, double h, double tolerance, const std::string &what) {
  b.forces();
  const double scale = b.largest_force();
  for (uint32_t i = 0; i < b.size(); i += 5)
    for (int a = 0; a < 3; ++a) {
      double &x = b.x[4 * i + a];
      const double keep = x;
      x = keep + h;
      const double more = b.energy();
      x = keep - h;
      const double less = b.energy();
      x = keep;
      EXPECT_NEAR(b.f[4 * i + a], -(more - less) / (2 * h), tolerance * scale) << what << ", point " << i;
    }
}

// Forces as they are now: their sum and their moment about the origin vanish to rounding.
inline void expect_no_force_or_torque(ModelInstance &b, const std::string &what) {
  Vec force{}, torque{};
  double scale = 0;
  for (uint32_t i = 0; i < b.size(); ++i) {
    const Vec x = b.get(b.x, i), f = b.get(b.f, i);
    force = force + f;
    torque = torque + cross(x, f);
    scale += norm(f) * std::max(1.0, norm(x));
  }
  EXPECT_LT(norm(force) + norm(torque), 1e-12 * scale) << what;
}

// Rodrigues' rotation about a unit axis.
inline Vec rotate(Vec x, Vec axis, double angle) {
  return std::cos(angle) * x + std::sin(angle) * cross(axis, x) +
         (dot(axis, x) * (1 - std::cos(angle))) * axis;
}

inline bool same_bits(const std::vector<double> &a, const std::vector<double> &b) {
  return a.size() == b.size() && !std::memcmp(a.data(), b.data(), a.size() * sizeof(double));
}

inline uint64_t fnv(const std::vector<double> &values) {
  uint64_t hash = 14695981039346656037ull;
  for (const double value : values) {
    unsigned char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    for (const unsigned char byte : bytes) hash = (hash ^ byte) * 1099511628211ull;
  }
  return hash;
}

}  // namespace model_test
