#include "arrows.h"

#include <algorithm>
#include <cmath>

#include "messages.h"
#include "render/geometry.h"

namespace view {

using render::Vec;

namespace {

constexpr double kLength = 0.22;  // of an arrow of full length, of the size of what is shown

void add(std::vector<double> &to, const Vec &a, const Vec &b) {
  to.insert(to.end(), {a.x, a.y, a.z, b.x, b.y, b.z});
}

}  // namespace

void add_arrow(std::vector<double> &xyz, const Vec &foot, const Vec &tip, const render::Camera &camera,
               double size) {
  const double length = render::norm(tip - foot), head = std::min(0.3 * length, 0.02 * size);
  const Vec along = render::unit(tip - foot);
  const Vec side = render::unit(cross(along, render::view_of(camera).back), {1, 0, 0});
  add(xyz, foot, tip);
  add(xyz, tip, tip - along * head + side * (0.5 * head));
  add(xyz, tip, tip - along * head - side * (0.5 * head));
}

std::vector<Touch> touches_of(const cli::SceneFile &scene) {
  std::vector<Touch> out;
  for (const dfm_contact &c : cli::listed<dfm_contact>(dfm_world_contacts, scene.world())) {
    const Vec normal = render::vec(c.normal), first = render::vec(c.tangent);
    const Vec on_a = normal * c.fn + first * c.ft[0] + cross(normal, first) * c.ft[1];
    // on the body that was made first, whichever side the contact is reported for
    out.push_back({render::vec(c.point), on_a * (c.body_b && c.body_b < c.body_a ? -1.0 : 1.0),
                   (c.flags & DFM_CONTACT_STICKING) != 0});
  }
  return out;
}

void Arrows::fill(const std::vector<Touch> &touches, double size, const render::Camera &camera,
                  render::Scene &out) {
  double top = 0;
  for (const Touch &t : touches) top = std::max(top, render::norm(t.force));
  // Follows a rise at once and a fall slowly, so that neighboring pictures can be compared.
  scale_ = std::max(top, 0.98 * scale_);
  for (std::vector<double> &xyz : xyz_) xyz.clear();
  for (const Touch &t : touches) {
    const double length = scale_ > 0 ? kLength * size * render::norm(t.force) / scale_ : 0;
    if (!(length > 0)) continue;
    add_arrow(xyz_[t.sticks ? 0 : 1], t.point, t.point + render::unit(t.force) * length, camera, size);
  }
  for (int i = 0; i < 2; ++i) {
    render::Lines lines;
    lines.xyz = xyz_[i].data();
    lines.n = uint32_t(xyz_[i].size() / 6);
    std::copy_n(i == 0 ? kSticks : kSlides, 3, lines.rgb);
    lines.width = 2.5f;
    lines.on_top = true;
    if (lines.n > 0) out.lines.push_back(lines);
  }
}

}  // namespace view
