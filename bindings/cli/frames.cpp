#include "frames.h"

#include "messages.h"
#include "run_folder.h"

#ifdef DEFORM_HAVE_RENDER
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "render/render.h"
#include "surface_stress.h"

namespace cli {
namespace {

constexpr uint32_t kWidth = 960, kHeight = 720;

class OffScreen : public Frames {
 public:
  OffScreen(const SceneFile &scene, std::string folder, std::unique_ptr<render::Renderer> renderer)
      : scene_(scene),
        folder_(std::move(folder)),
        renderer_(std::move(renderer)),
        color_(scene.settings().color) {
    for (const BodyView &body : scene.bodies()) {
      Buffers b;
      b.xyz.resize(3 * size_t(body.nsurfel));
      b.vectors.resize(3 * size_t(body.nsurfel));
      b.scalar.resize(body.nsurfel);
      uint32_t n = 0;
      need(dfm_surface_positions(body.handle, body.nsurfel, b.xyz.data(), &n));
      b.start = b.xyz;
      if (color_ == "stress") b.stress.emplace(body, b.xyz);
      if (b.stress && !b.stress->read(b.scalar))
        warn("body '" + body.name + "': model '" + body.model +
             "' tells no stress, so pictures show it in its own color");
      buffers_.push_back(std::move(b));
    }
    placed_.resize(scene.obstacles().size());
  }

  void draw(double t) override {
    render::Scene picture_scene;
    add_bodies(picture_scene);
    add_obstacles(picture_scene);
    // One extent for the whole film, and the camera that the first picture needs; where none is given, it
    // goes with bodies that would leave the frame.
    if (!extent_) {
      extent_ = render::bounds(picture_scene);
      const dfm_scene_settings &s = scene_.settings();
      render::Camera camera = render::auto_camera(picture_scene, double(kWidth) / kHeight);
      if (s.has_camera)
        for (int i = 0; i < 3; ++i) {
          camera.eye[i] = s.eye[i];
          camera.look_at[i] = s.look_at[i];
        }
      camera_ = camera;
      double square = 0;
      for (int i = 0; i < 3; ++i) square += std::pow(camera.eye[i] - camera.look_at[i], 2);
      distance_ = std::sqrt(square);
    } else if (!scene_.settings().has_camera) {
      camera_ = render::follow(*camera_, distance_, place_of_bodies(), double(kWidth) / kHeight);
    }
    picture_scene.extent = extent_;
    picture_scene.camera = camera_;
    if (color_ == "displacement") picture_scene.map = render::ColourMap::lagoon;
    render::Image image;
    std::string why;
    if (!renderer_->draw(picture_scene, image, &why))
      throw Failure(kBadInput, "frame " + std::to_string(drawn_) + ": " + why);
    annotate(image, picture_scene.map, t);
    char name[40];
    std::snprintf(name, sizeof name, "/frame_%06u.png", drawn_++);
    if (!render::write_png(folder_ + name, image, &why)) throw Failure(kBadInput, why);
  }

 private:
  struct Buffers {
    std::vector<double> xyz, start, vectors;
    std::vector<float> scalar;
    std::optional<SurfaceStress> stress;
    bool colored = false;
  };

  // Fills the scalars of one body in their own unit; false where the scene colors by body.
  bool fill_values(const BodyView &body, Buffers &b) {
    uint32_t n = 0;
    if (color_ == "body") return false;
    if (b.stress) return b.stress->read(b.scalar);
    if (color_ == "speed") need(dfm_surface_velocities(body.handle, body.nsurfel, b.vectors.data(), &n));
    else if (color_ == "contact") need(dfm_surface_forces(body.handle, body.nsurfel, b.vectors.data(), &n));
    else
      for (size_t i = 0; i < b.xyz.size(); ++i) b.vectors[i] = b.xyz[i] - b.start[i];
    for (size_t i = 0; i < b.scalar.size(); ++i) {
      const double *v = &b.vectors[3 * i];
      b.scalar[i] = float(std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
    }
    return true;
  }

  render::Bounds place_of_bodies() const {
    render::Bounds out;
    for (const Buffers &b : buffers_)
      for (size_t i = 0; i < b.xyz.size(); i += 3) out.add(&b.xyz[i]);
    return out;
  }

  void add_bodies(render::Scene &out) {
    float top = 0;
    for (size_t i = 0; i < buffers_.size(); ++i) {
      const BodyView &body = scene_.bodies()[i];
      uint32_t n = 0;
      need(dfm_surface_positions(body.handle, body.nsurfel, buffers_[i].xyz.data(), &n));
      buffers_[i].colored = fill_values(body, buffers_[i]);
      for (float x : buffers_[i].scalar) top = std::max(top, x);
    }
    // The scale of a film only grows, so colors of neighboring frames can be compared.
    scale_ = std::max(scale_, top);
    for (size_t i = 0; i < buffers_.size(); ++i) {
      Buffers &b = buffers_[i];
      const render::Color own = render::palette(uint32_t(i));
      render::Surface s;
      s.xyz = b.xyz.data();
      s.n = uint32_t(b.xyz.size() / 3);
      s.tri = scene_.bodies()[i].triangles.data();
      s.ntri = uint32_t(scene_.bodies()[i].triangles.size() / 3);
      s.rgb[0] = own.r;
      s.rgb[1] = own.g;
      s.rgb[2] = own.b;
      if (b.colored) {
        // Where nothing touches the body keeps its own color.
        for (float &x : b.scalar)
          x = color_ == "contact" && x == 0 ? std::numeric_limits<float>::quiet_NaN()
              : scale_ > 0                  ? x / scale_
                                            : 0;
        s.scalar = b.scalar.data();
      }
      out.surfaces.push_back(s);
    }
  }

  void add_obstacles(render::Scene &out) {
    for (size_t at = 0; at < placed_.size(); ++at) {
      const ObstacleView &o = scene_.obstacles()[at];
      if (o.def.ntriangle) {
        add_triangles(o, placed_[at], out);
        continue;
      }
      dfm_pose pose = {};
      need(dfm_obstacle_get_pose(o.handle, &pose));
      const double up[3] = {0, 0, 1};
      double axis[3];
      rotate(pose.rotation, up, axis);
      const double *p = pose.position;
      if (o.def.shape == DFM_SHAPE_PLANE) {
        out.planes.push_back({{p[0], p[1], p[2]}, {axis[0], axis[1], axis[2]}, {}});
      } else if (o.def.shape == DFM_SHAPE_SPHERE) {
        out.spheres.push_back({{p[0], p[1], p[2]}, o.def.radius, {}});
      } else if (o.def.shape == DFM_SHAPE_BOX) {
        render::Box box = {};
        for (int i = 0; i < 3; ++i) {
          box.pose.position[i] = p[i];
          box.half[i] = o.def.half_size[i];
        }
        for (int i = 0; i < 4; ++i) box.pose.rotation[i] = pose.rotation[i];
        box.look = {};
        out.boxes.push_back(box);
      } else if (o.def.shape == DFM_SHAPE_CAPSULE) {
        render::Capsule capsule = {};
        for (int i = 0; i < 3; ++i) {
          capsule.a[i] = p[i] - o.def.half_length * axis[i];
          capsule.b[i] = p[i] + o.def.half_length * axis[i];
        }
        capsule.radius = o.def.radius;
        capsule.look = {};
        out.capsules.push_back(capsule);
      }
    }
  }

  void add_triangles(const ObstacleView &o, std::vector<double> &placed, render::Scene &out) const {
    place_points(o, placed);
    render::Surface s;
    s.xyz = placed.data();
    s.n = o.def.npoint;
    s.tri = o.def.triangles;
    s.ntri = o.def.ntriangle;
    s.rgb[0] = 0.72f;
    s.rgb[1] = 0.73f;
    s.rgb[2] = 0.75f;  // no body's color
    out.surfaces.push_back(s);
  }

  void annotate(render::Image &image, render::ColourMap map, double t) const {
    char text[40];
    std::snprintf(text, sizeof text, "t = %.3f s", t);
    render::draw_text(image, 16, 28, 14, text, {0.15f, 0.17f, 0.2f});
    if (color_ == "speed") render::legend(image, map, 0, scale_, "speed", "m/s");
    if (color_ == "contact") render::legend(image, map, 0, scale_, "contact force", "N");
    if (color_ == "displacement") render::legend(image, map, 0, scale_, "displacement", "m");
    if (color_ == "stress") render::legend(image, map, 0, scale_, "von Mises stress", "Pa");
  }

  const SceneFile &scene_;
  std::string folder_;
  std::unique_ptr<render::Renderer> renderer_;
  std::string color_;
  std::vector<Buffers> buffers_;
  std::vector<std::vector<double>> placed_;  // of obstacles of triangles
  std::optional<render::Bounds> extent_;
  std::optional<render::Camera> camera_;
  double distance_ = 0;  // m, from the camera to what it looked at first
  float scale_ = 0;
  uint32_t drawn_ = 0;
};

}  // namespace

std::unique_ptr<Frames> Frames::create(const SceneFile &scene, const std::string &folder) {
  std::string why;
  auto renderer = render::Renderer::create(render::Backend::automatic, kWidth, kHeight, &why);
  if (!renderer) {
    warn("no pictures: " + why);
    return nullptr;
  }
  make_folder(folder);
  return std::make_unique<OffScreen>(scene, folder, std::move(renderer));
}

}  // namespace cli

#else

namespace cli {

std::unique_ptr<Frames> Frames::create(const SceneFile &, const std::string &) {
  warn(
      "no pictures: this deform was built without the renderer (cmake -DDEFORM_RENDER=ON, Debian packages "
      "libegl-dev or libosmesa6-dev)");
  return nullptr;
}

}  // namespace cli

#endif
