// Snapshot, restore and hash: everything that a later result depends on, and nothing else. Candidate lists are left out on purpose:
// contacts come from exact geometry, so lists that are built anew give the same contacts (broad/).
#include <cstring>

#include "core/error.h"
#include "core/hash.h"
#include "world/world.h"

namespace dfm {
namespace {

constexpr char kMagic[8] = {'d', 'f', 'm', 's', 'n', 'a', 'p', '1'};

// What must be the same in the world that a snapshot is restored into.
uint64_t structure(const World &w) {
  Hash h;
  for (auto &b : w.bodies) {
    h.add(b->id), h.add(b->p.n), h.add(b->surface.nsurfel), h.add(uint64_t(b->model.state.size()));
    h.add(b->model.type->id, std::strlen(b->model.type->id));
    h.add(b->tets.data(), b->tets.size() * sizeof(uint32_t));
  }
  for (auto &o : w.obstacles) h.add(o->id), h.add(o->def.shape);
  for (auto &l : w.laws) h.add(l->type->id, std::strlen(l->type->id)), h.add(l->params.data(), l->params.size() * sizeof(double));
  return h.value;
}

// One list of fields serves writing and reading.
struct Writer {
  std::vector<unsigned char> &out;
  void bytes(const void *p, size_t n) { out.insert(out.end(), static_cast<const unsigned char *>(p), static_cast<const unsigned char *>(p) + n); }
  template <class T>
  void value(const T &x) { bytes(&x, sizeof x); }
  template <class A>
  void array(const A &a) { value(uint64_t(a.size())), bytes(a.data(), a.size() * sizeof(a[0])); }
};

struct Reader {
  const unsigned char *p, *end;
  void bytes(void *to, size_t n) {
    if (size_t(end - p) < n) fail(DFM_E_FORMAT, "snapshot is cut short: %zu bytes missing; nothing was restored", n - size_t(end - p));
    std::memcpy(to, p, n), p += n;
  }
  template <class T>
  void value(T &x) { bytes(&x, sizeof x); }
  template <class A>
  void array(A &a) {
    uint64_t n;
    value(n);
    if (n > uint64_t(end - p) / sizeof(a[0])) fail(DFM_E_FORMAT, "snapshot is damaged: an array of %llu entries does not fit; nothing was restored", static_cast<unsigned long long>(n));
    a.resize(n);
    bytes(a.data(), n * sizeof(a[0]));
  }
};

template <class Stream, class W>
void fields(Stream &s, W &w) {
  s.value(w.time), s.value(w.step_count), s.value(w.stable), s.value(w.hold_start), s.value(w.holding), s.value(w.stats), s.value(w.gravity);
  for (auto &b : w.bodies) {
    s.array(b->p.x), s.array(b->p.v), s.array(b->p.held), s.array(b->p.load), s.array(b->model.state), s.value(b->contact_impulse);
  }
  for (auto &o : w.obstacles) s.value(o->pose), s.value(o->target), s.value(o->has_target);
  auto &c = w.store;
  s.value(c.n), s.value(c.nstate), s.value(c.h);
  s.array(c.key), s.array(c.id_a), s.array(c.id_b), s.array(c.by_key), s.array(c.normal), s.array(c.tangent), s.array(c.impulse), s.array(c.bristle);
  s.array(c.law), s.array(c.dwell), s.array(c.path), s.array(c.touching), s.array(c.held), s.array(c.began);
  s.array(w.work);
}

}  // namespace

uint64_t world_hash(const World &w) {
  Hash h;
  for (auto &b : w.bodies) {
    for (const Array<double> *a : {&b->p.x, &b->p.v, &b->model.state}) h.add(a->data(), a->size() * sizeof(double));
  }
  const ContactStore &c = w.store;
  h.add(c.key.data(), c.key.size() * sizeof(uint64_t));
  h.add(c.bristle.data(), c.bristle.size() * sizeof(double));
  return h.value;
}

void world_snapshot(const World &w, std::vector<unsigned char> &out) {
  Writer s{out};
  s.bytes(kMagic, sizeof kMagic);
  s.value(structure(w));
  s.value(w.bound_age);
  fields(s, w);
  Hash h;
  h.add(out.data(), out.size());
  s.value(h.value);
}

void world_restore(World &w, const void *data, size_t bytes) {
  w.prepare();
  const unsigned char *const p = static_cast<const unsigned char *>(data);
  if (bytes < sizeof kMagic + 16 || std::memcmp(p, kMagic, sizeof kMagic) != 0)
    fail(DFM_E_FORMAT, "these %zu bytes are no snapshot of this version; take one with dfm_world_snapshot", bytes);
  // The checksum is read first: past it, sizes and arrays are known to be what was written, so reading cannot fail half way.
  Hash h;
  h.add(p, bytes - sizeof(uint64_t));
  uint64_t sum;
  std::memcpy(&sum, p + bytes - sizeof sum, sizeof sum);
  if (sum != h.value) fail(DFM_E_FORMAT, "the snapshot is damaged (checksum); nothing was restored");
  Reader s{p + sizeof kMagic, p + bytes - sizeof sum};
  uint64_t shape;
  s.value(shape);
  if (shape != structure(w))
    fail(DFM_E_FORMAT, "the snapshot belongs to another world: bodies, meshes, models, obstacles and laws must be the same; nothing was restored");
  s.value(w.bound_age);
  fields(s, w);
  for (auto &b : w.bodies) update_inverse_mass(b->p);
  w.worst_body = nullptr;
  w.report.n = 0;
}

}  // namespace dfm
