#ifdef DEFORM_HAVE_RENDER
#include "drawing.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "json_text.h"
#include "messages.h"

namespace cli {

namespace {

constexpr float kThrough = 0.45f;  // of a contact patch that something hides

// Pa; Young's modulus of the softest material, or that of a body that has none.
double softest_of(const SceneFile &scene) {
  double least = HUGE_VAL;
  JsonValue materials;
  if (parse_json(scene.value("/materials"), materials))
    for (const JsonMember &m : materials.members) least = std::min(least, m.value.scalar("young"));
  return std::isfinite(least) ? least : dfm_material_def_default().young;
}

}  // namespace

Drawing::Drawing(const SceneFile &scene, const std::string &color)
    : scene_(scene), upright_(scene), softest_(softest_of(scene)) {
  scene.renew_list();  // the world may be in a later state already
  for (size_t i = 0; i < scene.bodies().size(); ++i) {
    scene.renew(i);
    make(scene.bodies()[i], buffers_.emplace_back());
  }
  for (const Buffers &b : buffers_)
    for (const double x : b.xyz) reach_ = std::max(reach_, std::fabs(x));
  placed_.resize(scene.obstacles().size());
  set_color(color);
}

void Drawing::make(const BodyView &body, Buffers &b) {
  b.of = body.handle;
  b.shape = body.shape;
  b.xyz.resize(3 * size_t(body.nsurfel));
  b.vectors.resize(3 * size_t(body.nsurfel));
  b.scalar.assign(body.nsurfel, 0.f);
  uint32_t n = 0;
  need(dfm_surface_positions(body.handle, body.nsurfel, b.xyz.data(), &n));
  b.stress.reset();
}

void Drawing::set_color(const std::string &color) {
  color_ = color;
  top_ = 0;
  fixed_.reset();
  JsonValue range;  // of the scene's own color only
  if (color == scene_.settings().color && parse_json(scene_.value("/output/color_range"), range) &&
      range.items.size() == 2)
    fixed_ = {std::strtof(range.items[0].text.c_str(), nullptr),
              std::strtof(range.items[1].text.c_str(), nullptr)};
  for (Buffers &b : buffers_) std::ranges::fill(b.scalar, 0.f);
  if (color != "stress") return;
  for (size_t i = 0; i < buffers_.size(); ++i) {
    Buffers &b = buffers_[i];
    const BodyView &body = scene_.bodies()[i];
    if (!b.stress) b.stress.emplace(body, b.xyz);
    if (!b.stress->read(b.scalar))
      warn("body '" + body.name + "': model '" + body.model +
           "' provides no stress, so pictures show it in its own color");
  }
}

// Fills the scalars of one body in their own unit; false where the scene colors by body.
bool Drawing::fill_values(const BodyView &body, Buffers &b) {
  uint32_t n = 0;
  if (color_ == "body") return false;
  if (color_ == "stress") return b.stress->read(b.scalar);
  if (color_ == "speed") need(dfm_surface_velocities(body.handle, body.nsurfel, b.vectors.data(), &n));
  else if (color_ == "contact") need(dfm_surface_forces(body.handle, body.nsurfel, b.vectors.data(), &n));
  else need(dfm_debug_surface_displacements(body.handle, body.nsurfel, b.vectors.data(), &n));
  for (size_t i = 0; i < b.scalar.size(); ++i) {
    const double *v = &b.vectors[3 * i];
    b.scalar[i] = float(std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
  }
  return true;
}

// What rounding leaves in a body at rest, with a margin of many digits below all that can be seen: strains of
// 1e-10, and positions and their change per second that relate to coordinates likewise. It is drawn as zero.
float Drawing::noise() const {
  if (color_ == "contact") return 0;  // exactly zero where nothing touches
  return float(1e-10 * (color_ == "stress" ? softest_ : reach_));
}

render::Bounds Drawing::place_of_bodies() const {
  render::Bounds out;
  for (const Buffers &b : buffers_)
    for (size_t i = 0; i < b.xyz.size(); i += 3) out.add(&b.xyz[i]);
  return out;
}

void Drawing::add_bodies(render::Scene &out) {
  const float least = noise();
  scene_.renew_list();
  if (!std::ranges::equal(buffers_, scene_.bodies(), {}, &Buffers::of, &BodyView::handle)) {  // cuts
    std::vector<Buffers> before = std::exchange(buffers_, {});
    for (const BodyView &body : scene_.bodies()) {
      if (const auto old = std::ranges::find(before, body.handle, &Buffers::of); old != before.end()) {
        buffers_.push_back(std::move(*old));
        continue;
      }
      Buffers &b = buffers_.emplace_back();
      make(body, b);
      if (color_ == "stress") b.stress.emplace(body, b.xyz);
    }
  }
  for (size_t i = 0; i < buffers_.size(); ++i) {
    const BodyView &body = scene_.bodies()[i];
    scene_.renew(i);
    if (buffers_[i].shape != body.shape) {  // cut or torn
      make(body, buffers_[i]);
      if (color_ == "stress") buffers_[i].stress.emplace(body, buffers_[i].xyz);
    }
    uint32_t n = 0;
    need(dfm_surface_positions(body.handle, body.nsurfel, buffers_[i].xyz.data(), &n));
    buffers_[i].colored = fill_values(body, buffers_[i]);
    for (float &x : buffers_[i].scalar) {
      if (x < least) x = 0;
      top_ = std::max(top_, x);
    }
  }
  for (size_t i = 0; i < buffers_.size(); ++i) add_surface(i, out);
}

void Drawing::add_surface(size_t i, render::Scene &out) {
  Buffers &b = buffers_[i];
  const render::Color own = render::palette(scene_.bodies()[i].number);
  render::Surface s;
  s.xyz = b.xyz.data();
  s.n = uint32_t(b.xyz.size() / 3);
  s.tri = scene_.bodies()[i].triangles.data();
  s.ntri = uint32_t(scene_.bodies()[i].triangles.size() / 3);
  s.rgb[0] = own.r;
  s.rgb[1] = own.g;
  s.rgb[2] = own.b;
  if (b.colored) {
    const auto [low, high] = range();
    const bool contact = color_ == "contact";  // where nothing touches, the body keeps its own color
    for (float &x : b.scalar)
      x = contact && x == 0 ? std::numeric_limits<float>::quiet_NaN()
          : high > low      ? (x - low) / (high - low)
                            : 0;
    s.scalar = b.scalar.data();
    if (contact) s.through = kThrough;
  }
  out.surfaces.push_back(s);
}

void add_solid(const Solid &o, bool slab, render::Scene &out) {
  const double up[3] = {0, 0, 1};
  double axis[3];
  rotate(o.pose.rotation, up, axis);
  const double *p = o.pose.position;
  if (o.shape == DFM_SHAPE_PLANE) {
    out.planes.push_back({{p[0], p[1], p[2]}, {axis[0], axis[1], axis[2]}, {}, slab});
  } else if (o.shape == DFM_SHAPE_SPHERE) {
    out.spheres.push_back({{p[0], p[1], p[2]}, o.radius, {}});
  } else if (o.shape == DFM_SHAPE_BOX) {
    render::Box box = {};
    for (int i = 0; i < 3; ++i) {
      box.pose.position[i] = p[i];
      box.half[i] = o.half_size[i];
    }
    for (int i = 0; i < 4; ++i) box.pose.rotation[i] = o.pose.rotation[i];
    box.look = {};
    out.boxes.push_back(box);
  } else if (o.shape == DFM_SHAPE_CAPSULE) {
    render::Capsule capsule = {};
    for (int i = 0; i < 3; ++i) {
      capsule.a[i] = p[i] - o.half_length * axis[i];
      capsule.b[i] = p[i] + o.half_length * axis[i];
    }
    capsule.radius = o.radius;
    capsule.look = {};
    out.capsules.push_back(capsule);
  }
}

void add_gray(const std::vector<double> &xyz, const uint32_t *triangles, uint32_t n, render::Scene &out) {
  render::Surface s;
  s.xyz = xyz.data();
  s.n = uint32_t(xyz.size() / 3);
  s.tri = triangles;
  s.ntri = n;
  s.rgb[0] = 0.72f;
  s.rgb[1] = 0.73f;
  s.rgb[2] = 0.75f;  // no body's color
  out.surfaces.push_back(s);
}

void Drawing::add_obstacles(render::Scene &out) {
  for (size_t at = 0; at < placed_.size(); ++at) {
    const ObstacleView &o = scene_.obstacles()[at];
    if (o.def.ntriangle) {
      place_points(o, placed_[at]);
      add_gray(placed_[at], o.def.triangles, o.def.ntriangle, out);
      continue;
    }
    Solid solid = {o.def.shape, {}, {}, o.def.radius, o.def.half_length};
    std::copy_n(o.def.half_size, 3, solid.half_size);
    need(dfm_obstacle_get_pose(o.handle, &solid.pose));
    add_solid(solid, upright_.tilts(), out);
  }
}

void Drawing::fill(render::Scene &out) {
  add_bodies(out);
  add_obstacles(out);
  upright_.at(dfm_world_time(scene_.world()), out.up);
  if (color_ == "displacement") out.map = render::ColorMap::lagoon;
}

bool Drawing::legend(Legend &out) const {
  if (std::ranges::none_of(buffers_, &Buffers::colored)) return false;
  out.map = color_ == "displacement" ? render::ColorMap::lagoon : render::ColorMap::ember;
  out.range = range();
  static const struct {
    const char *color, *title, *unit;
  } kMeanings[] = {{"speed", "speed", "m/s"},
                   {"contact", "contact force", "N"},
                   {"displacement", "displacement", "m"},
                   {"stress", "von Mises stress", "Pa"}};
  for (const auto &meaning : kMeanings)
    if (color_ == meaning.color) {
      out.title = meaning.title;
      out.unit = meaning.unit;
      return true;
    }
  return false;
}

}  // namespace cli
#endif
