// A scene as the renderer takes it: bodies colored as "output"/"color" says, obstacles as they are now, up
// against gravity.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "render/render.h"
#include "surface_stress.h"
#include "upright.h"

namespace cli {

// An obstacle that has no triangles. slab: of a plane, render.h.
struct Solid {
  uint32_t shape;  // DFM_SHAPE_*
  dfm_pose pose;
  double half_size[3], radius, half_length;
};
void add_solid(const Solid &solid, bool slab, render::Scene &out);
// A surface in the color of obstacles; it reads xyz and triangles where they are.
void add_gray(const std::vector<double> &xyz, const uint32_t *triangles, uint32_t n, render::Scene &out);

class Drawing {
 public:
  Drawing(const SceneFile &scene, const std::string &color);
  // "body" "contact" "speed" "displacement" "stress"
  void set_color(const std::string &color);
  const std::string &color() const { return color_; }
  // Surfaces and obstacles of the world as it is now; what they point to lives here until the next call.
  void fill(render::Scene &out);
  render::Bounds place_of_bodies() const;
  // [n,3] m, of the last fill().
  const std::vector<double> &positions(size_t body) const { return buffers_[body].xyz; }
  // The values at the ends of the map, in the unit of the quantity.
  struct Range { float low = 0, high = 0; };
  // "output"/"color_range"; where the scene has none, 0 to the largest value so far.
  Range range() const { return fixed_ ? *fixed_ : Range{0, top_}; }
  bool range_grows() const { return color_ != "body" && !fixed_; }
  // What the colors mean: false where each body has its own, as without a model that gives the quantity.
  struct Legend {
    render::ColorMap map = render::ColorMap::ember;
    Range range;
    std::string title, unit;
  };
  bool legend(Legend &out) const;

 private:
  struct Buffers {
    dfm_body of = 0;
    uint32_t shape = 0;
    std::vector<double> xyz, vectors;
    std::vector<float> scalar;
    std::optional<SurfaceStress> stress;
    bool colored = false;
  };
  // Fills the buffers with a body as it is now; displacements count from here.
  static void make(const BodyView &body, Buffers &b);
  bool fill_values(const BodyView &body, Buffers &b);
  float noise() const;
  void add_surface(size_t body, render::Scene &out);
  void add_bodies(render::Scene &out);
  void add_obstacles(render::Scene &out);

  const SceneFile &scene_;
  Upright upright_;
  std::string color_;
  std::optional<Range> fixed_;
  double softest_, reach_ = 0;  // Pa; m, the largest coordinate at the start
  std::vector<Buffers> buffers_;
  std::vector<std::vector<double>> placed_;  // of obstacles of triangles
  float top_ = 0;                            // of all fills
};

}  // namespace cli
