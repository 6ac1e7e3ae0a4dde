// Any bytes as a mesh file, one program per reader (DEFORM_FUZZ_READER): an error with a sentence, or a mesh
// whose numbers hold together; never a crash, never more memory than a small multiple of the bytes.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "mesh/raw_mesh.h"

namespace {

// Compressed arrays may unpack to 64 times their file; a polygon's corner of one byte stands for a triangle,
// which repair sorts.
constexpr size_t kMultiple = 256, kBase = 65536;

struct Capped {
  size_t held = 0, cap = 0;
  dfm::Memory hooks;
  Capped() {
    hooks.user = this;
    hooks.alloc = [](void *user, size_t bytes, size_t align) -> void * {
      Capped &m = *static_cast<Capped *>(user);
      if (bytes > m.cap - std::min(m.cap, m.held)) std::abort();
      m.held += bytes;
      return std::aligned_alloc(align, (std::max<size_t>(bytes, 1) + align - 1) / align * align);
    };
    hooks.release = [](void *user, void *p, size_t bytes, size_t) {
      static_cast<Capped *>(user)->held -= bytes;
      std::free(p);
    };
  }
};

template <class Mesh>
void check(const Mesh &mesh, const dfm::Array<uint32_t> &corners, const dfm::Array<uint32_t> &group) {
  for (const double x : mesh.points)
    if (!std::isfinite(x)) std::abort();
  for (const uint32_t p : corners)
    if (p >= mesh.npoint()) std::abort();
  for (const uint32_t g : group)
    if (g != dfm::kNoGroup && g >= mesh.groups.size()) std::abort();
  for (const dfm::MeshGroup &g : mesh.groups)
    for (const uint32_t p : g.points)
      if (p >= mesh.npoint()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  Capped memory;
  memory.cap = kBase + kMultiple * size;
  try {
    dfm::RawMesh raw(memory.hooks);
    dfm::Cursor in("fuzz", reinterpret_cast<const char *>(data), size);
    dfm::DEFORM_FUZZ_READER(in, raw);
    check(raw, raw.tets, raw.tet_group);
    check(raw, raw.tris, raw.tri_group);
    if (raw.tets.size() != 4 * raw.tet_group.size() || raw.tris.size() != 3 * raw.tri_group.size())
      std::abort();
    if (raw.tets.empty()) {
      const dfm::RestMesh mesh = dfm::finish_surface("fuzz", std::move(raw));
      check(mesh, mesh.tris, mesh.tri_group);
    } else {
      const dfm::RestMesh mesh = dfm::finish_mesh("fuzz", std::move(raw));
      check(mesh, mesh.tets, mesh.tet_group);
      check(mesh, mesh.tris, mesh.tri_group);
    }
  } catch (const dfm::Error &e) {
    if (e.sentence.empty()) std::abort();
  }
  return 0;
}
