// Any bytes as packets of a stream, and any bytes over good ones: passed over, or a scene whose numbers hold
// together and whose memory is bounded.
//
// Input: a byte that chooses. Even: the rest is a datagram. Odd: the rest is a list of {u16 place, u8 value}
// that are put into a scene and a frame that the library has written.
#include <cmath>
#include <vector>

#include "cli/rtp.h"
#include "fuzz_file.h"
#include "live/received.h"

namespace {

using Bytes = std::vector<unsigned char>;

void need(bool holds) {
  if (!holds) std::abort();
}

void write(dfm_world world, uint32_t kind, uint32_t flags, Bytes &out) {
  dfm_stream_def def = dfm_stream_def_default();
  def.kind = kind;
  def.flags = flags;
  size_t bytes = 0;
  need(dfm_world_stream(world, &def, nullptr, &bytes) == DFM_OK);
  const size_t before = out.size();
  out.resize(before + bytes);
  need(dfm_world_stream(world, &def, &out[before], &bytes) == DFM_OK);
  out.resize(before + bytes);
}

Bytes good() {
  dfm_world_def d = dfm_world_def_default();
  dfm_world world = 0;
  need(dfm_world_create(fuzz::context(), &d, &world) == DFM_OK);
  dfm_obstacle_def floor = dfm_obstacle_def_default();
  dfm_obstacle obstacle = 0;
  need(dfm_obstacle_create(world, &floor, &obstacle) == DFM_OK);
  const double size[3] = {0.1, 0.1, 0.1};
  dfm_mesh_handle mesh = 0;
  need(dfm_mesh_make(fuzz::context(), "beam", size, DFM_MESH_CELLS, 10, &mesh) == DFM_OK);
  dfm_mesh_info info{};
  info.size = sizeof info;
  need(dfm_mesh_get_info(mesh, &info) == DFM_OK);
  dfm_body_def b = dfm_body_def_default();
  b.npoint = info.npoint;
  b.ntet = info.ntet;
  b.points = info.points;
  b.tets = info.tets;
  dfm_body body = 0;
  need(dfm_body_create(world, &b, &body) == DFM_OK);
  for (int i = 0; i < 20; ++i) need(dfm_world_step(world, 1e-3, nullptr) == DFM_OK);
  Bytes out;
  write(world, DFM_STREAM_SCENE, 0, out);
  write(world, DFM_STREAM_FRAME, DFM_STREAM_CONTACTS, out);
  write(world, DFM_STREAM_FRAME, DFM_STREAM_FLOAT32, out);
  need(dfm_world_destroy(world) == DFM_OK);
  return out;
}

void check(const live::Received &scene) {
  need(std::isfinite(scene.time()));
  for (const auto &[number, mesh] : scene.meshes()) {
    const live::Received::Mesh *const m = mesh.drawn();
    if (!m || m->x.empty()) continue;
    for (const double x : m->x) need(std::isfinite(x));
    for (const uint32_t corner : m->triangles) need(size_t{corner} < m->x.size() / 3);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static const Bytes known = good();
  if (size == 0) return 0;
  Bytes bytes(data + 1, data + size);
  if (data[0] % 2 == 1) {
    bytes = known;
    for (size_t i = 1; i + 2 < size; i += 3)
      bytes[size_t(data[i] | data[i + 1] << 8) % bytes.size()] = data[i + 2];
  }
  live::Received scene;
  scene.read(known.data(), data[0] % 4 < 2 ? 0 : known.size());
  scene.read(bytes.data(), bytes.size());
  check(scene);
  cli::each_report(bytes.data(), bytes.size(), [&](const unsigned char *at, size_t n) {
    need(at >= bytes.data() && n <= bytes.size() - size_t(at - bytes.data()));
  });
  dfm_stream_def def = dfm_stream_def_default();
  def.packet = 256;
  size_t most = 4 * known.size();
  Bytes packed(most);
  if (dfm_stream_pack(bytes.data(), bytes.size(), &def, packed.data(), &most) != DFM_OK)
    need(dfm_last_error()[0] != 0);
  return 0;
}
