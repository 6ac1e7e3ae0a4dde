#include "deform/id.h"

#include "core/handle.h"
#include "state/obstacle.h"

using namespace dfm;

static_assert(DFM_HANDLE_WORLD == int(Kind::world) && DFM_HANDLE_BODY == int(Kind::body));
static_assert(DFM_HANDLE_OBSTACLE == int(Kind::obstacle) && DFM_HANDLE_MATERIAL == int(Kind::material));
static_assert(DFM_HANDLE_LAW == int(Kind::law) && DFM_HANDLE_SCENE == int(Kind::scene));
static_assert(DFM_HANDLE_MESH == int(Kind::mesh) && DFM_HANDLE_TOOL == int(Kind::tool));

uint32_t dfm_handle_kind(uint64_t handle) {
  const Kind kind = handle_kind(handle);
  if (kind != Kind::obstacle) return uint32_t(kind);
  const auto *const o = static_cast<const Obstacle *>(handle_find(Kind::obstacle, handle));
  return o && o->rigid && !o->added ? DFM_HANDLE_RIGID : DFM_HANDLE_OBSTACLE;
}
