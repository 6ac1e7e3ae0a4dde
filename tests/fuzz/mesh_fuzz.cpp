// Any bytes as a mesh file: an error with a sentence, or a mesh whose numbers hold together; never a crash, never much memory.
#include <cmath>

#include "deform/deform.h"
#include "fuzz_file.h"

static void check(dfm_tetmesh mesh) {
  dfm_tetmesh_info info = {};
  info.size = sizeof info;
  const double *points = nullptr;
  const uint32_t *tets = nullptr;
  if (dfm_tetmesh_get_info(mesh, &info) != DFM_OK || dfm_tetmesh_data(mesh, &points, &tets, nullptr) != DFM_OK) std::abort();
  for (uint32_t i = 0; i < 3 * info.npoint; ++i)
    if (!std::isfinite(points[i])) std::abort();
  for (uint32_t i = 0; i < 4 * info.ntet; ++i)
    if (tets[i] >= info.npoint) std::abort();
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  dfm_context *const context = fuzz::context();
  for (const char *ending : {".msh", ".vtk"}) {
    const fuzz::File file(data, size, ending);
    dfm_tetmesh mesh = 0;
    const dfm_status status = dfm_tetmesh_read(context, file.path(), &mesh);
    if (status == DFM_OK) check(mesh), dfm_tetmesh_destroy(mesh);
    else if (dfm_last_error()[0] == 0) std::abort();
  }
  return 0;
}
