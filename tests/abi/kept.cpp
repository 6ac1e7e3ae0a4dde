// Plays the host to a plugin that was built long ago, with the structs of today's plugin.h, and prints what
// it answers: one line per thing asked, a hash of all bits and one number of them. Nothing of the library
// takes part, so the lines stay the same for ever (tests/abi/kept).
//
// Structs of the plugin are read as they lie: what ABI 1 had when it was frozen, every kept plugin has.
//
// kept FILE           the structs of this header
// kept FILE grown     the same, as a later host lends them: longer, with garbage behind what ABI 1 has
#include <dlfcn.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "deform/plugin.h"

namespace {

bool grown = false;

// A struct of the host, and what a later ABI 1 may put behind it.
template <class T>
struct Lent {
  T known{};
  uint64_t behind[6] = {0xbad1bad1, 0xbad2bad2, 0xbad3bad3, 0xbad4bad4, 0xbad5bad5, 0xbad6bad6};
  Lent() { known.size = uint32_t(grown ? sizeof *this : sizeof known); }
};

void need(bool good, const std::string &what) {
  if (good) return;
  std::printf("FAILED %s\n", what.c_str());
  std::exit(1);
}

void reported(const std::string &id, const char *what, const double *values, size_t n) {
  uint64_t hash = 0xcbf29ce484222325ull;  // FNV-1a
  for (size_t i = 0; i < n; ++i) {
    unsigned char bytes[sizeof(double)];
    std::memcpy(bytes, values + i, sizeof bytes);
    for (const unsigned char b : bytes) hash = (hash ^ b) * 0x100000001b3ull;
  }
  std::printf("%s,%s,%zu,%016llx,%.17g\n", id.c_str(), what, n, static_cast<unsigned long long>(hash),
              n ? values[n / 2] : 0.0);
}
void reported(const std::string &id, const char *what, const std::vector<double> &values) {
  reported(id, what, values.data(), values.size());
}

// Numbers without a library: those of Marsaglia's xorshift.
struct Random {
  uint64_t s = 0x9e3779b97f4a7c15ull;
  double operator()(double a, double b) {
    s ^= s << 13;
    s ^= s >> 7;
    s ^= s << 17;
    return a + (b - a) * (double(s >> 11) * 0x1p-53);
  }
};

// What the plugin may be lent.
struct Host {
  Lent<dfm_host> table;
  std::vector<std::vector<double>> scratch;
  Host() {
    dfm_host &h = table.known;
    h.abi = grown ? DFM_ABI + 1 : DFM_ABI;
    h.abi_draft = grown ? 1 : DFM_ABI_DRAFT;
    h.abi_min = DFM_ABI_MIN;
    h.ctx = this;
    h.alloc = [](void *, size_t bytes, size_t align) -> void * {
      return std::aligned_alloc(align, (bytes + align - 1) / align * align);
    };
    h.release = [](void *, void *p, size_t, size_t) { std::free(p); };
    h.scratch = [](void *ctx, size_t bytes) -> void * {
      auto &all = static_cast<Host *>(ctx)->scratch;
      all.emplace_back(bytes / sizeof(double) + 16);
      const uintptr_t at = reinterpret_cast<uintptr_t>(all.back().data());
      return reinterpret_cast<void *>((at + 63) & ~uintptr_t(63));
    };
    h.log = [](void *, int32_t, uint32_t, const char *text) { std::fprintf(stderr, "%s\n", text); };
    h.parallel_for = [](void *, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t),
                        void *user) {
      for (uint32_t begin = 0; begin < n; begin += grain)
        fn(user, begin, n - begin < grain ? n : begin + grain);
    };
    h.extension = [](void *, const char *) -> const void * { return nullptr; };
  }
};

// An array at a multiple of 64 bytes, as plugins may expect.
struct Column {
  std::vector<double> memory;
  double *at;
  size_t n;
  explicit Column(size_t count, double value = 0) : memory(count + 8, value), n(count) {
    at = reinterpret_cast<double *>((reinterpret_cast<uintptr_t>(memory.data()) + 63) & ~uintptr_t(63));
  }
  Column(const Column &) = delete;
  Column &operator=(const Column &) = delete;
};

std::vector<double> defaults(const dfm_type &type) {
  std::vector<double> out;
  for (uint32_t i = 0; i < type.nparam; ++i) {
    const auto &row = *reinterpret_cast<const dfm_param *>(reinterpret_cast<const char *>(type.params) +
                                                           size_t(i) * type.param_size);
    out.insert(out.end(), row.width, row.def);
  }
  return out;
}

// ---- laws: 40 contacts slide, turn, are pressed and released ----------------------------------------------

uint32_t width_of(const dfm_slot *slots, uint32_t n, uint32_t slot_size) {
  uint32_t sum = 0;
  for (uint32_t i = 0; i < n; ++i)
    sum += reinterpret_cast<const dfm_slot *>(reinterpret_cast<const char *>(slots) +
                                              size_t(i) * (slot_size ? slot_size : 16))
               ->width;
  return sum;
}

void call_law(const Host &host, const dfm_type &type) {
  const auto &law = *static_cast<const dfm_friction *>(type.ops);
  const std::vector<double> params = defaults(type);
  const dfm_slots *own = law.state ? law.state(params.data()) : nullptr;
  const uint32_t nstate =
      own ? width_of(own->slots, own->nslot, own->slot_size) : width_of(law.slots, law.nslot, law.slot_size);
  void *data = nullptr;
  if (law.prepare) need(law.prepare(&host.table.known, params.data(), &data) == DFM_OK, "prepare");
  const uint32_t n = 40, stride = 40;
  Column fn(n), vt(2 * n), stop(2 * n), area(n), dwell(n), state(nstate * n);
  Column ft(2 * n), next(nstate * n), dv(4 * n), dn(2 * n), limit(n), stored(n);
  alignas(64) uint8_t mode[64] = {};
  Random random;
  std::vector<double> all[6];
  for (int step = 0; step < 50; ++step) {
    for (uint32_t i = 0; i < n; ++i) {
      fn.at[i] = step % 10 == 9 && i % 4 == 0 ? 0 : random(0.1, 20);
      area.at[i] = 1e-4 * (1 + i % 3);
      dwell.at[i] = 1e-3 * step;
      for (uint32_t c = 0; c < 2; ++c) {
        vt.at[c * stride + i] = random(-1, 1) * (i % 2 ? 1e-4 : 0.3);
        stop.at[c * stride + i] = random(-6, 6);
      }
    }
    Lent<dfm_friction_in> in;
    Lent<dfm_friction_out> out;
    in.known.n = n;
    in.known.stride = stride;
    in.known.dt = 1e-3;
    in.known.params = params.data();
    in.known.data = data;
    in.known.fn = fn.at;
    in.known.vt = vt.at;
    in.known.ft_stop = stop.at;
    in.known.area = area.at;
    in.known.dwell = dwell.at;
    in.known.state = state.at;
    out.known.ft = ft.at;
    out.known.state = next.at;
    out.known.dft_dvt = dv.at;
    out.known.dft_dfn = dn.at;
    out.known.limit = limit.at;
    out.known.mode = mode;
    out.known.stored = stored.at;
    need(law.eval(&in.known, &out.known) == DFM_OK, "eval");
    const Column *const columns[] = {&ft, &next, &dv, &dn, &stored};
    for (size_t k = 0; k < 5; ++k)
      all[k].insert(all[k].end(), columns[k]->at, columns[k]->at + columns[k]->n);
    for (uint32_t i = 0; i < n; ++i) {
      all[5].push_back(limit.at[i]);
      all[5].push_back(mode[i]);
    }
    std::memcpy(state.at, next.at, nstate * n * sizeof(double));
  }
  const char *const names[] = {"ft", "state", "dft_dvt", "dft_dfn", "stored", "limit and mode"};
  for (size_t k = 0; k < 6; ++k) reported(type.id, names[k], all[k]);
  if (law.release) law.release(&host.table.known, data);
}

// ---- models: a block of 2 x 2 x 1 cubes -------------------------------------------------------------------

struct Solid {
  std::vector<double> rest, mass, weight;
  std::vector<uint32_t> cells, edges, row, col;
  std::vector<uint8_t> fixed;
  uint32_t n() const { return uint32_t(mass.size()); }
};

double volume(const Solid &s, const uint32_t *q) {
  double d[3][3];
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) d[k][c] = s.rest[3 * q[k + 1] + c] - s.rest[3 * q[0] + c];
  return (d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
          d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
          d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0])) /
         6;
}

Solid block() {
  Solid s;
  Random random;
  const auto number = [](uint32_t x, uint32_t y, uint32_t z) { return x + 3 * (y + 3 * z); };
  for (uint32_t z = 0; z < 2; ++z)
    for (uint32_t y = 0; y < 3; ++y)
      for (uint32_t x = 0; x < 3; ++x)
        for (const uint32_t k : {x, y, z}) s.rest.push_back(0.1 * k + random(-0.01, 0.01));
  s.mass.assign(18, 0.0);
  const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for (uint32_t y = 0; y < 2; ++y)
    for (uint32_t x = 0; x < 2; ++x)
      for (const auto &order : orders) {
        uint32_t at[3] = {x, y, 0}, q[4] = {number(x, y, 0)};
        for (int k = 0; k < 3; ++k) {
          ++at[order[k]];
          q[k + 1] = number(at[0], at[1], at[2]);
        }
        if (volume(s, q) < 0) std::swap(q[2], q[3]);
        for (int a = 0; a < 4; ++a) {
          s.cells.push_back(q[a]);
          s.mass[q[a]] += 1000 * volume(s, q) / 4;
          for (int b = 0; b < a; ++b) edges.insert(std::minmax(q[a], q[b]));
        }
      }
  for (const auto &[a, b] : edges) s.edges.insert(s.edges.end(), {a, b});
  for (uint32_t i = 0; i < s.n(); ++i) {  // the surface's vertices are the points
    s.row.push_back(i);
    s.col.push_back(i);
    s.weight.push_back(1);
    s.fixed.push_back(0);
  }
  s.row.push_back(s.n());
  return s;
}

size_t state_size(const dfm_model &model, const dfm_slots *own, const Solid &s) {
  const dfm_slot *slots = own ? own->slots : model.slots;
  const uint32_t given = own ? own->slot_size : model.slot_size, step = given ? given : 16;
  const std::map<uint32_t, size_t> count = {{DFM_PER_POINT, s.n()},
                                            {DFM_PER_CELL, s.cells.size() / 4},
                                            {DFM_PER_EDGE, s.edges.size() / 2},
                                            {DFM_PER_INSTANCE, 1}};
  size_t total = 0;
  for (uint32_t i = 0; i < (own ? own->nslot : model.nslot); ++i) {
    const auto &slot =
        *reinterpret_cast<const dfm_slot *>(reinterpret_cast<const char *>(slots) + size_t(i) * step);
    total += count.at(slot.unit) * slot.width;
  }
  return total;
}

// One body; x and v have four doubles per point.
struct Body {
  const dfm_type &type;
  const dfm_model &ops;
  const Solid &solid;
  std::vector<double> params;
  void *self = nullptr;
  Column x, v, f, x_end, v_end;
  std::vector<double> state, next;
  double t = 0;
  Body(const Host &host, const dfm_type &of, const Solid &s)
      : type(of),
        ops(*static_cast<const dfm_model *>(of.ops)),
        solid(s),
        params(defaults(of)),
        x(4 * s.n()),
        v(4 * s.n()),
        f(4 * s.n()),
        x_end(4 * s.n()),
        v_end(4 * s.n()) {
    static const char *const no_key = nullptr;
    static const double *const no_field = nullptr;
    Lent<dfm_mesh> m;
    m.known.npoint = m.known.nsurfel = s.n();
    m.known.ncell = uint32_t(s.cells.size() / 4);
    m.known.cell = DFM_CELL_TET;
    m.known.rest = s.rest.data();
    m.known.cells = s.cells.data();
    m.known.mass = s.mass.data();
    m.known.params = params.data();
    m.known.field_keys = &no_key;
    m.known.fields = &no_field;
    m.known.nedge = uint32_t(s.edges.size() / 2);
    m.known.edges = s.edges.data();
    m.known.row = s.row.data();
    m.known.col = s.col.data();
    m.known.weight = s.weight.data();
    m.known.fixed = s.fixed.data();
    need(ops.create(&host.table.known, &m.known, &self) == DFM_OK && self, "create");
    const auto *own = static_cast<const dfm_slots *>(extension(DFM_EXT_SLOTS));
    state.assign(state_size(ops, own, s), 0.0);
    if (!state.empty() && ops.state_init) need(ops.state_init(self, state.data()) == DFM_OK, "state_init");
    next = state;
    Random random;
    for (uint32_t i = 0; i < s.n(); ++i)
      for (int c = 0; c < 3; ++c) {
        x.at[4 * i + c] = s.rest[3 * i + c] + random(-2e-3, 2e-3);
        v.at[4 * i + c] = random(-0.1, 0.1);
      }
  }
  ~Body() { ops.destroy(self); }
  Body(const Body &) = delete;
  Body &operator=(const Body &) = delete;
  const void *extension(const char *id) const { return ops.extension ? ops.extension(self, id) : nullptr; }
  void fill(Lent<dfm_kin> &k, bool trial) {
    k.known.stride = 4;
    k.known.t = t;
    k.known.dt = 1e-4;
    k.known.x = x.at;
    k.known.v = v.at;
    k.known.state = state.empty() ? nullptr : state.data();
    k.known.state_out = trial && !state.empty() ? next.data() : nullptr;
  }
  void reported_by(const char *what) const {
    std::vector<double> all(x.at, x.at + x.n);
    all.insert(all.end(), v.at, v.at + v.n);
    all.insert(all.end(), state.begin(), state.end());
    reported(type.id, what, all);
  }
};

void call_forces(Body &b) {
  Lent<dfm_kin> k;
  b.fill(k, false);
  const uint32_t n = b.solid.n();
  need(b.ops.add_forces(b.self, &k.known, b.f.at) == DFM_OK, "add_forces");
  reported(b.type.id, "add_forces", b.f.at, b.f.n);
  std::vector<double> row(2 * size_t(n), 0.0);
  double h = 1;
  if (b.ops.bound) need(b.ops.bound(b.self, &k.known, row.data(), row.data() + n, &h) == DFM_OK, "bound");
  row.push_back(h);
  reported(b.type.id, "bound", row);
  if (b.ops.caps & DFM_CAP_ENERGY) {
    double joule = 0;
    need(b.ops.energy(b.self, &k.known, &joule) == DFM_OK, "energy");
    reported(b.type.id, "energy", &joule, 1);
  }
  if (b.ops.caps & DFM_CAP_STIFFNESS) {
    uint32_t nb = 0;
    need(b.ops.pattern(b.self, &nb, nullptr) == DFM_OK, "pattern");
    std::vector<uint32_t> ij(2 * size_t(nb));
    need(b.ops.pattern(b.self, &nb, ij.data()) == DFM_OK, "pattern");
    Column blocks(9 * size_t(nb));
    need(b.ops.stiffness(b.self, &k.known, 1, 0.5, blocks.at) == DFM_OK, "stiffness");
    std::vector<double> all(ij.begin(), ij.end());
    all.insert(all.end(), blocks.at, blocks.at + blocks.n);
    reported(b.type.id, "pattern and stiffness", all);
  }
  for (int step = 0; step < 20; ++step) {
    Lent<dfm_kin> now;
    b.fill(now, true);
    std::memset(b.f.at, 0, b.f.n * sizeof(double));
    need(b.ops.add_forces(b.self, &now.known, b.f.at) == DFM_OK, "add_forces");
    for (uint32_t i = 0; i < 4 * n; ++i) {
      if (i % 4 == 3) continue;
      b.v.at[i] += 1e-4 / b.solid.mass[i / 4] * b.f.at[i];
      b.x.at[i] += 1e-4 * b.v.at[i];
    }
    b.state = b.next;
    b.t += 1e-4;
  }
  b.reported_by("after 20 steps");
}

void call_stepper(Body &b, const dfm_stepper &stepper) {
  const uint32_t n = b.solid.n();
  const uint32_t touched[] = {1, 4, 16};
  std::vector<double> u(3 * size_t(n)), p(9), du(9), w(27), results;
  for (int step = 0; step < 20; ++step) {
    Lent<dfm_kin> k;
    b.fill(k, true);
    for (uint32_t i = 0; i < n; ++i) b.f.at[4 * i + 2] = -9.81 * b.solid.mass[i];
    need(stepper.predict(b.self, &k.known, b.f.at, u.data()) == DFM_OK, "predict");
    for (int i = 0; i < 9; ++i) p[i] = 1e-3 * (i - 4);
    need(stepper.respond(b.self, &k.known, 3, touched, p.data(), du.data()) == DFM_OK, "respond");
    need(stepper.diagonal(b.self, &k.known, 3, touched, w.data()) == DFM_OK, "diagonal");
    if (stepper.respond_many) {
      std::vector<double> many(9);
      need(stepper.respond_many(b.self, &k.known, 3, touched, 1, p.data(), many.data()) == DFM_OK,
           "respond_many");
      need(many == du, "respond_many answers otherwise than respond");
    }
    std::vector<double> impulses(3 * size_t(n), 0.0);
    for (int i = 0; i < 9; ++i) impulses[3 * touched[i / 3] + i % 3] = p[i];
    need(stepper.commit(b.self, &k.known, impulses.data(), b.x_end.at, b.v_end.at) == DFM_OK, "commit");
    for (const auto *part : {&u, &du, &w}) results.insert(results.end(), part->begin(), part->end());
    for (uint32_t i = 0; i < 4 * n; ++i) {
      b.x.at[i] = i % 4 == 3 ? 0 : b.x_end.at[i];
      b.v.at[i] = i % 4 == 3 ? 0 : b.v_end.at[i];
    }
    b.state = b.next;
    b.t += 1e-4;
  }
  reported(b.type.id, "predict respond diagonal", results);
  b.reported_by("after 20 steps");
}

void call_model(const Host &host, const dfm_type &type) {
  const Solid solid = block();
  Body b(host, type, solid);
  const auto *stepper = static_cast<const dfm_stepper *>(b.extension("dfm.stepper/1"));
  if (stepper) call_stepper(b, *stepper);
  else call_forces(b);
  if (const auto *e = static_cast<const dfm_cell_energy *>(b.extension(DFM_EXT_CELL_ENERGY))) {
    Lent<dfm_kin> k;
    b.fill(k, false);
    std::vector<double> density(solid.cells.size() / 4);
    need(e->cell_energy(b.self, &k.known, density.data()) == DFM_OK, "cell_energy");
    reported(type.id, "cell_energy", density);
  }
  need(!b.extension("dfm.unheard-of/1"), "an answer to an unknown extension");
}

// ---- solvers: a chain of six points -----------------------------------------------------------------------

void call_solver(const Host &host, const dfm_type &type) {
  const auto &solver = *static_cast<const dfm_solver *>(type.ops);
  std::vector<uint32_t> ij;
  std::vector<double> blk, b, x(36, 0.0);
  for (uint32_t i = 0; i < 6; ++i)
    for (uint32_t j = i; j < 6 && j < i + 2; ++j) {
      ij.insert(ij.end(), {i, j});
      for (uint32_t e = 0; e < 9; ++e)
        blk.push_back(i == j ? (e % 4 ? 0.25 : 4.0 + i) : (e % 4 ? 0.125 : -1));
    }
  for (uint32_t i = 0; i < 36; ++i) b.push_back(1.0 / (1 + i));
  void *self = nullptr;
  need(solver.analyse(&host.table.known, 6, uint32_t(ij.size() / 2), ij.data(), &self) == DFM_OK, "analyse");
  need(solver.factor(self, blk.data()) == DFM_OK, "factor");
  need(solver.solve(self, 2, b.data(), x.data(), 1e-12) == DFM_OK, "solve");
  reported(type.id, "solve", x);
  solver.release(self);
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 2) return 2;
  grown = argc > 2 && std::string(argv[2]) == "grown";
  void *image = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
  need(image, image ? "" : dlerror());
  const auto entry = reinterpret_cast<dfm_plugin_fn>(dlsym(image, "dfm_plugin_entry"));
  need(entry, "no dfm_plugin_entry");
  Host host;
  const dfm_plugin *plugin = entry(&host.table.known, host.table.known.abi, DFM_ABI_MIN);
  need(plugin, "the entry refuses a host that speaks ABI 1");
  need(plugin->abi == 1 && plugin->abi_draft == 0, "the plugin is of another ABI");
  for (uint32_t i = 0; i < plugin->ntype; ++i) {
    const dfm_type &type = *plugin->types[i];
    if (type.kind == DFM_KIND_FRICTION) call_law(host, type);
    else if (type.kind == DFM_KIND_MODEL) call_model(host, type);
    else if (type.kind == DFM_KIND_SOLVER) call_solver(host, type);
  }
  if (plugin->shutdown) plugin->shutdown();
  return 0;
}
