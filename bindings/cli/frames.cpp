#include "frames.h"

#include "messages.h"
#include "run_folder.h"

#ifdef DEFORM_HAVE_RENDER
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "drawing.h"
#include "kept_frames.h"

namespace cli {
namespace {

constexpr uint32_t kWidth = 960, kHeight = 720;

class OffScreen : public Frames {
 public:
  OffScreen(const SceneFile &scene, std::string folder, std::unique_ptr<render::Renderer> renderer)
      : scene_(scene),
        folder_(std::move(folder)),
        renderer_(std::move(renderer)),
        drawing_(scene, scene.settings().color) {}

  void draw(double t) override {
    render::Scene picture_scene;
    drawing_.fill(picture_scene);
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
      camera_ = render::follow(*camera_, distance_, drawing_.place_of_bodies(), double(kWidth) / kHeight);
    }
    std::copy_n(picture_scene.up, 3, camera_->up);
    picture_scene.extent = extent_;
    picture_scene.camera = camera_;
    write(picture_scene, t, drawn_);
    if (drawing_.range_grows()) {
      if (!kept_) kept_.emplace(folder_);
      kept_->add({t, drawing_.range().high, picture_scene});
    }
    ++drawn_;
  }

  void finish() override {
    if (!kept_) return;
    kept_->rewind();
    const double top = drawing_.range().high;
    KeptFrame frame;
    for (uint32_t i = 0; kept_->next(frame); ++i) {
      if (frame.top == top) continue;
      kept_->rescale(float(frame.top / top));
      write(frame.scene, frame.t, i);
    }
    kept_.reset();
  }

  std::string drawn_by() const override { return renderer_->device(); }

 private:
  void write(const render::Scene &picture_scene, double t, uint32_t number) {
    render::Image image;
    std::string why;
    if (!renderer_->draw(picture_scene, image, &why))
      throw Failure(kBadInput, "frame " + std::to_string(number) + ": " + why);
    annotate(image, t);
    if (!render::write_png(folder_ + formatted("/frame_%06u.png", number), image, &why))
      throw Failure(kBadInput, why);
  }

  void annotate(render::Image &image, double t) const {
    render::draw_text(image, 16, 28, 14, formatted("t = %.3f s", t), {0.15f, 0.17f, 0.2f});
    Drawing::Legend l;
    if (drawing_.legend(l)) render::legend(image, l.map, l.range.low, l.range.high, l.title, l.unit);
  }

  const SceneFile &scene_;
  std::string folder_;
  std::unique_ptr<render::Renderer> renderer_;
  Drawing drawing_;
  std::optional<render::Bounds> extent_;
  std::optional<render::Camera> camera_;
  double distance_ = 0;  // m, from the camera to its first target
  std::optional<KeptFrames> kept_;
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
