// Any bytes as a snapshot, and any bytes over a good one behind a checksum that holds: refused with a
// sentence, or a world that answers and takes a step.
//
// Input: a byte that chooses. Even: the rest is the snapshot. Odd: the rest is a list of {u16 place, u8
// value} that are put into a good one.
#include <cstring>
#include <vector>

#include "deform/deform.h"
#include "fuzz_file.h"
#include "unit/world/sealed_snapshot.h"

namespace {

void need(dfm_status s) {
  if (s != DFM_OK) std::abort();
}

struct Scene {
  dfm_world world = 0;
  std::vector<uint8_t> good;
  Scene() {
    dfm_context *const c = fuzz::context();
    dfm_world_def d = dfm_world_def_default();
    d.sleep = 1;
    d.sleep_speed = 0.5;
    d.sleep_time = 2e-3;
    need(dfm_world_create(c, &d, &world));
    dfm_obstacle_def floor = dfm_obstacle_def_default();
    floor.name = "floor";
    dfm_obstacle obstacle = 0;
    need(dfm_obstacle_create(world, &floor, &obstacle));
    const double size[3] = {0.1, 0.1, 0.1};
    dfm_mesh_handle mesh = 0;
    need(dfm_mesh_make(c, "beam", size, DFM_MESH_CELLS, 10, &mesh));
    dfm_mesh_info info{};
    info.size = sizeof info;
    need(dfm_mesh_get_info(mesh, &info));
    dfm_body_def b = dfm_body_def_default();
    b.npoint = info.npoint;
    b.ntet = info.ntet;
    b.points = info.points;
    b.tets = info.tets;
    const char *const names[] = {"sleeper", "lower", "upper"};
    const double places[3][3] = {{2, 0, 4e-5}, {0, 0, 4e-5}, {0.01, 0.01, 0.1001}};
    for (int k = 0; k < 3; ++k) {
      b.name = names[k];
      std::memcpy(b.pose.position, places[k], sizeof places[k]);
      dfm_body body = 0;
      need(dfm_body_create(world, &b, &body));
      const uint32_t points[] = {0, 1};
      const double force[6] = {0.1};
      const dfm_sine wobble{{0.5, 0, 0}, 30, 0.2};
      if (k == 2) need(dfm_body_add_load(body, 2, points, force, 0, nullptr, &wobble, nullptr));
      dfm_cut_def plane = dfm_cut_def_default();
      plane.shape = DFM_CUT_PLANE;
      plane.how = DFM_CUT_SPLIT;
      plane.blade[2] = 0.15;
      plane.blade[5] = 1;
      for (const double t : {0.012005, 0.1})  // the first one in the step after the snapshot
        if (k == 2) need(dfm_body_plan_cut(body, t, &plane));
      if (k == 1) {
        need(dfm_body_hold(body, 2, points, 7));
        need(dfm_body_move_held(body, 2, points, 0, nullptr, &wobble));
      }
    }
    for (int i = 0; i < 60; ++i) need(dfm_world_step(world, 2e-4, nullptr));
    size_t bytes = 0;
    need(dfm_world_snapshot(world, nullptr, &bytes));
    good.resize(bytes);
    need(dfm_world_snapshot(world, good.data(), &bytes));
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static const Scene scene;
  if (size == 0) return 0;
  std::vector<uint8_t> bytes;
  if (data[0] % 2 == 0) {
    bytes.assign(data + 1, data + size);
    if (data[0] % 4 == 0 && bytes.size() >= sizeof(dfm::SnapshotHead)) {
      std::memcpy(bytes.data(), scene.good.data(), sizeof(dfm::SnapshotHead));
      test::seal(bytes);
    }
  } else {
    bytes = scene.good;
    const size_t head = sizeof(dfm::SnapshotHead), fields = bytes.size() - head;
    for (size_t i = 1; i + 2 < size; i += 3)
      bytes[head + size_t(data[i] | data[i + 1] << 8) % fields] = data[i + 2];
    test::seal(bytes);
  }
  const dfm_status status = dfm_world_restore(scene.world, bytes.data(), bytes.size());
  if (status != DFM_OK) return dfm_last_error()[0] ? 0 : (std::abort(), 0);
  uint32_t n = 0;
  dfm_world_contacts(scene.world, 0, nullptr, &n);
  std::vector<dfm_contact> contacts(n);
  dfm_world_contacts(scene.world, n, contacts.data(), &n);
  dfm_world_step(scene.world, 1e-5, nullptr);
  need(dfm_world_restore(scene.world, scene.good.data(), scene.good.size()));
  return 0;
}
