#include "scene/start.h"

#include "scene/jitter.h"
#include "scene/rotation.h"

namespace dfm::scene {

std::vector<double> start_positions(const Start &start, const BodyMesh &mesh, const dfm_pose &pose) {
  std::vector<double> x(mesh.points);
  Jitter random(start.seed);
  const Quat turn = load_quat(pose.rotation);
  for (size_t i = 0; i < x.size(); i += 3) {
    for (size_t k = 0; k < 3; ++k) {
      const double center = (mesh.lo[k] + mesh.hi[k]) / 2, half = (mesh.hi[k] - mesh.lo[k]) / 2;
      switch (start.kind) {
        case StartKind::scramble: x[i + k] = center + half * random.symmetric(); break;
        // the plane keeps x and y, the line x alone
        case StartKind::plane:
          if (k > 1) x[i + k] = center;
          break;
        case StartKind::line:
          if (k > 0) x[i + k] = center;
          break;
        case StartKind::point: x[i + k] = center; break;
        case StartKind::invert: x[i + k] = 2 * center - x[i + k]; break;
        case StartKind::rest:
        case StartKind::state: break;
      }
    }
    double turned[3];
    rotate(turn, &x[i], turned);
    for (size_t k = 0; k < 3; ++k) x[i + k] = turned[k] + pose.position[k];
  }
  return x;
}

}  // namespace dfm::scene
