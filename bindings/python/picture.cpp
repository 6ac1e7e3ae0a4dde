// Pictures for the Python package: the renderer behind plain C functions that ctypes calls. What is added
// stays until the next one begins. One thread at a time for each picture; the package sees to that.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "deform/plugin.h"
#include "render/render.h"

#define PICTURE_API extern "C" __attribute__((visibility("default")))

namespace {

// "ember", or "lagoon" where it is 1.
render::ColorMap map_of(uint32_t map) {
  return map == 1 ? render::ColorMap::lagoon : render::ColorMap::ember;
}

struct Legend {
  double low, high;
  std::string title, unit;
};

struct Picture {
  std::unique_ptr<render::Renderer> renderer;
  render::Scene scene;
  std::vector<std::pair<std::string, double>> texts;  // and the height of their base line
  std::optional<Legend> legend;
  bool tilts = false;
  std::exception_ptr trouble;  // of what was to be added
};

// No exception goes on into C.
template <class F>
int attempt(char *why, size_t capacity, F f) {
  try {
    f();
    return DFM_OK;
  } catch (const std::bad_alloc &) {
    std::snprintf(why, capacity, "no memory for a picture of this size");
    return DFM_E_NOMEM;
  } catch (const std::exception &e) {
    std::snprintf(why, capacity, "%s", e.what());
    return DFM_E_UNSUPPORTED;
  }
}

template <class F>
void add(void *picture, F f) {
  Picture &p = *static_cast<Picture *>(picture);
  try {
    f(p);
  } catch (...) {
    p.trouble = std::current_exception();
  }
}

template <size_t N>
void copy(double (&to)[N], const double *from) {
  std::copy(from, from + N, to);
}

}  // namespace

/** @param why out, [capacity] one sentence where no picture can be made here. @return DFM_OK or DFM_E_*. */
PICTURE_API int deform_picture_create(uint32_t width, uint32_t height, void **out, char *why,
                                      size_t capacity) {
  return attempt(why, capacity, [&] {
    auto picture = std::make_unique<Picture>();
    std::string reason;
    picture->renderer = render::Renderer::create(render::Backend::automatic, width, height, &reason);
    if (!picture->renderer) throw std::runtime_error(reason);
    *out = picture.release();
  });
}
PICTURE_API void deform_picture_destroy(void *picture) { delete static_cast<Picture *>(picture); }

/** A body's color, repeating after ten. @param rgb out, [3] 0..1 */
PICTURE_API void deform_picture_palette(uint32_t i, double *rgb) {
  const render::Color color = render::palette(i);
  rgb[0] = color.r;
  rgb[1] = color.g;
  rgb[2] = color.b;
}

/** Colors of a map at equal distances. @param map 1: that of displacements; rgb out, [n,3] 0..1 */
PICTURE_API void deform_picture_map(uint32_t map, uint32_t n, double *rgb) {
  for (uint32_t i = 0; i < n; ++i) {
    const render::Color color = render::map_color(map_of(map), float(i) / float(n - 1));
    const double channels[3] = {color.r, color.g, color.b};
    std::copy_n(channels, 3, rgb + size_t(3) * i);
  }
}

/** Forgets what was added before, also where it was never drawn.
 * @param up [3] unit, against gravity; tilts: it changes during the film that this is a frame of */
PICTURE_API void deform_picture_begin(void *picture, const double *up, uint32_t tilts) {
  Picture &p = *static_cast<Picture *>(picture), next;
  next.renderer = std::move(p.renderer);
  copy(next.scene.up, up);
  next.tilts = tilts != 0;
  p = std::move(next);
}

/** What the colors of values mean. @param low, high at the ends of the map */
PICTURE_API void deform_picture_legend(void *picture, uint32_t map, double low, double high,
                                       const char *title, const char *unit) {
  add(picture, [&](Picture &p) {
    p.scene.map = map_of(map);
    p.legend = {low, high, title, unit};
  });
}

/** @param xyz [n,3] m; tri [ntri,3]; rgb [3] 0..1; scalar [n] 0..1, NaN: rgb; NULL: rgb everywhere.
 * through: how much of the values is seen through what hides them, 0..1. All but rgb stay the caller's, until
 * the picture is drawn. */
PICTURE_API void deform_picture_surface(void *picture, uint32_t n, const double *xyz, uint32_t ntri,
                                        const uint32_t *tri, const double *rgb, const float *scalar,
                                        double through) {
  add(picture, [&](Picture &p) {
    p.scene.surfaces.push_back(
        {xyz, n, tri, ntri, {float(rgb[0]), float(rgb[1]), float(rgb[2])}, scalar, float(through)});
  });
}

/** @param pose [7] position m, rotation x y z w; size [3] m: box half_size; sphere radius; capsule radius,
 * half of its axis. shape as DFM_SHAPE_*. */
PICTURE_API void deform_picture_shape(void *picture, uint32_t shape, const double *pose, const double *axis,
                                      const double *size) {
  add(picture, [&](Picture &p) {
    render::Scene &scene = p.scene;
    if (shape == 0) {
      render::Plane plane = {};
      copy(plane.point, pose);
      copy(plane.normal, axis);
      plane.look = {};
      scene.planes.push_back(plane);
    } else if (shape == 1) {
      scene.spheres.push_back({{pose[0], pose[1], pose[2]}, size[0], {}});
    } else if (shape == 2) {
      render::Box box = {};
      copy(box.pose.position, pose);
      copy(box.pose.rotation, pose + 3);
      copy(box.half, size);
      box.look = {};
      scene.boxes.push_back(box);
    } else if (shape == 3) {
      render::Capsule capsule = {};
      for (int i = 0; i < 3; ++i) {
        capsule.a[i] = pose[i] - size[1] * axis[i];
        capsule.b[i] = pose[i] + size[1] * axis[i];
      }
      capsule.radius = size[0];
      capsule.look = {};
      scene.capsules.push_back(capsule);
    }
  });
}

/** @param eye, look_at [3] m, world. Without it the camera finds its place by itself. After
 * deform_picture_begin. */
PICTURE_API void deform_picture_camera(void *picture, const double *eye, const double *look_at) {
  render::Camera camera = {};
  copy(camera.eye, eye);
  copy(camera.look_at, look_at);
  copy(camera.up, static_cast<Picture *>(picture)->scene.up);
  camera.fov_deg = 30;
  static_cast<Picture *>(picture)->scene.camera = camera;
}

/** A line of text (ASCII) from the upper left corner downward. */
PICTURE_API void deform_picture_text(void *picture, const char *text) {
  add(picture, [&](Picture &p) { p.texts.emplace_back(text, 28 + 22.0 * double(p.texts.size())); });
}

/** Draws what was added. @param rgb out, [height,width,3], rows from the top
 * @return DFM_OK, or DFM_E_*: why says what was refused */
PICTURE_API int deform_picture_draw(void *handle, uint8_t *rgb, char *why, size_t capacity) {
  Picture &picture = *static_cast<Picture *>(handle);
  return attempt(why, capacity, [&] {
    if (picture.trouble) std::rethrow_exception(picture.trouble);
    for (render::Plane &plane : picture.scene.planes) plane.slab = picture.tilts;
    render::Image image;
    std::string reason;
    if (!picture.renderer->draw(picture.scene, image, &reason)) throw std::runtime_error(reason);
    for (const auto &[text, y] : picture.texts)
      render::draw_text(image, 16, y, 14, text, {0.15f, 0.17f, 0.2f});
    if (const auto &l = picture.legend)
      render::legend(image, picture.scene.map, l->low, l->high, l->title, l->unit);
    std::copy(image.rgb.begin(), image.rgb.end(), rgb);
  });
}
