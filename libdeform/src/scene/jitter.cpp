#include "scene/jitter.h"

#include "scene/rotation.h"

namespace dfm::scene {

double Jitter::symmetric() {
  // splitmix64 (Steele, Lea, Flood 2014): any seed gives a full-period, well-mixed sequence.
  uint64_t z = state_ += 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  z ^= z >> 31;
  return double(z >> 11) * 0x1p-52 - 1.0;
}

void Jitter::apply(double size, const double center[3], dfm_pose &pose, double velocity[3], double spin[3]) {
  double shift[3], axis[3];
  for (double &s : shift) s = 1e-3 * size * symmetric();
  for (double &a : axis) a = symmetric();
  const double angle = 0.5 * symmetric();
  if (axis[0] == 0 && axis[1] == 0 && axis[2] == 0) axis[2] = 1;
  const Quat old = load_quat(pose.rotation), turned = rotation(axis, angle) * old;
  double before[3], after[3];
  rotate(old, center, before);
  rotate(turned, center, after);
  for (int i = 0; i < 3; ++i) pose.position[i] += before[i] - after[i] + shift[i];
  store_quat(pose.rotation, turned);
  const double faster = 1 + 0.01 * symmetric(), spinning = 1 + 0.01 * symmetric();
  symmetric();  // reserved for another quantity, so that adding one does not change existing results
  for (int i = 0; i < 3; ++i) {
    velocity[i] *= faster;
    spin[i] *= spinning;
  }
}

}  // namespace dfm::scene
