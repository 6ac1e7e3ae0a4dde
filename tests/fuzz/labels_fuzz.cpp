// Any bytes as a volume of labels: an error with a sentence, or a volume whose numbers hold together; of
// small ones the surfaces are closed and do not cross.
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "labels/label_surface.h"
#include "messages.h"

namespace {

constexpr size_t kSmall = 2000;  // voxels

void surfaces(labels::Volume volume) {
  std::vector<uint32_t> group(volume.value.size());
  for (size_t i = 0; i < group.size(); ++i) group[i] = uint32_t((i + 1) / 2);  // labels in pairs
  volume = labels::cropped(volume);
  labels::compose("fuzz", volume, group);
  std::vector<double> target(volume.value.size(), 0.0);
  for (const uint16_t l : volume.voxel) target[l] += std::fabs(volume.cell());
  const labels::Surfaces found = labels::surfaces_of(volume, target, 4);
  if (found.crossing) std::abort();
  for (size_t l = 1; l < volume.value.size(); ++l) {
    std::vector<bool> inside(volume.value.size(), false);
    inside[l] = true;
    if (labels::shell_of(found, inside).open_edges) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  try {
    labels::Volume volume = labels::read_labels("", {reinterpret_cast<const char *>(data), size}, 0);
    if (volume.voxel.size() != volume.voxels() || volume.value.empty() || volume.value[0] != 0) std::abort();
    for (const uint16_t v : volume.voxel)
      if (v >= volume.value.size()) std::abort();
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 3; ++c)
        if (!std::isfinite(volume.origin[k]) || !std::isfinite(volume.axis[k][c])) std::abort();
    if (volume.voxels() <= kSmall) surfaces(std::move(volume));
  } catch (const cli::Failure &e) {
    if (!*e.what()) std::abort();
  }
  return 0;
}
