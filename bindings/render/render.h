// Surfaces -> picture, off-screen: EGL surfaceless first, OSMesa second, the same GL code on both. Plain
// structs in, 8-bit RGB out; nothing here knows the library, and no GL name leaves this folder. Lengths in
// meters, colors as sRGB in 0..1, quaternions x, y, z, w.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace render {

struct Image {
  uint32_t width = 0, height = 0;
  std::vector<uint8_t> rgb;  // rows from the top, 3 bytes each pixel
  bool operator==(const Image &other) const;
};

struct Bounds {
  double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300};
  bool empty() const { return !(lo[0] <= hi[0]); }
  void add(const double p[3]);
};

struct Camera {
  double eye[3], look_at[3], up[3] = {0, 0, 1};
  double fov_deg = 30;  // vertical
};

struct Pose {
  double position[3] = {0, 0, 0}, rotation[4] = {0, 0, 0, 1};  // all zero reads as no rotation
};

// A triangle mesh; the arrays stay the caller's and are read during draw() only. Triangles wind
// counter-clockwise seen from outside.
struct Surface {
  const double *xyz = nullptr;  // [n,3]
  uint32_t n = 0;
  const uint32_t *tri = nullptr;  // [ntri,3]
  uint32_t ntri = 0;
  float rgb[3] = {0.8f, 0.8f, 0.8f};
  // [n] 0..1 through Scene::map; NaN shows rgb there; null shows rgb everywhere
  const float *scalar = nullptr;
  // how much of the color of its values is seen through whatever hides them
  float through = 0;
};

struct Look {
  float rgb[3] = {0.72f, 0.75f, 0.79f};
  float alpha = 1;  // below 1: seen through, casts no shadow
};
// A plane square to Scene::up is drawn as the floor (the highest one), any other as a tilted slab sized to
// the scene. From below, the floor is a veil; another plane whose back faces the camera is left out.
struct Plane {
  double point[3], normal[3];
  Look look;
  bool slab = false;  // a slab even while it is level: a table that a film tilts
};
struct Box {
  Pose pose;
  double half[3];
  Look look;
};
struct Sphere {
  double center[3];
  double radius;
  Look look;
};
// a and b are the centers of its caps
struct Capsule {
  double a[3], b[3];
  double radius;
  Look look;
};
// Segments as ribbons that face the camera, e.g. contact normals.
struct Lines {
  const double *xyz = nullptr;  // [2 n,3]: start, end, start, end
  uint32_t n = 0;
  float rgb[3] = {0.1f, 0.1f, 0.1f};
  float width = 2;      // pixels
  bool on_top = false;  // not hidden by what lies before them
};

// our own paths through OKLab: dark to light warm, dark to light cool
enum class ColorMap { ember, lagoon };

struct Scene {
  std::vector<Surface> surfaces;
  std::vector<Plane> planes;
  std::vector<Box> boxes;
  std::vector<Sphere> spheres;
  std::vector<Capsule> capsules;
  std::vector<Lines> lines;
  double up[3] = {0, 0, 1};      // against gravity
  std::optional<Camera> camera;  // none: auto_camera() over `extent`
  // what grid, slabs and camera are sized to; none: bounds(scene). Give one for all frames of a film.
  std::optional<Bounds> extent;
  ColorMap map = ColorMap::ember;
};

// Box around surfaces, spheres, capsules and boxes (not planes); a solid far larger than the surfaces counts
// only near them.
Bounds bounds(const Scene &scene);
// Three-quarter view from the front right that just holds the box.
Camera auto_camera(const Bounds &bounds, double aspect, const double up[3]);
// The same for the extent of a scene with its ramps and a floor that is near; what draw() takes where the
// scene has no camera.
Camera auto_camera(const Scene &scene, double aspect);

// The camera moved, in the same direction of view and by as little as it takes, so that the box lies inside
// the frame and about as far away as what the camera looked at first (`distance`); farther only where the box
// is too large. It moves as smoothly as the box does.
Camera follow(const Camera &camera, double distance, const Bounds &box, double aspect);

enum class Backend { automatic, egl, osmesa };

class Renderer {
 public:
  // Null where no picture can be made here: *why_not is then one sentence that names the Debian package to
  // install. Libraries are loaded at run time. For Backend::automatic the environment's DEFORM_RENDER_BACKEND
  // (egl, osmesa, none) decides where it is set.
  static std::unique_ptr<Renderer> create(Backend backend, uint32_t width, uint32_t height,
                                          std::string *why_not);
  virtual ~Renderer() = default;
  // One thread at a time for each renderer. Makes its context current and releases it again. False: *why_not
  // says what GL refused.
  virtual bool draw(const Scene &scene, Image &picture, std::string *why_not = nullptr) = 0;
  virtual const char *backend() const = 0;  // "egl" or "osmesa"
  virtual const char *device() const = 0;   // what GL calls itself, e.g. "llvmpipe (LLVM 15.0.6, 256 bits)"
};

// How much light is traced: `full` is that of every off-screen picture; `fast` takes an eighth of the sky's
// directions and no second samples, for windows on machines whose GL is software.
enum class Detail { full, fast };
using Symbol = void (*)();
using SymbolOf = Symbol (*)(const char *name);

// The same pictures in a window, whose GL context of 3.3 or later its owner has made current on this thread
// and keeps so.
class WindowRenderer : public Renderer {
 public:
  // As Renderer::create; symbol_of finds GL's functions. A window of another size needs another renderer.
  static std::unique_ptr<WindowRenderer> create(SymbolOf symbol_of, Detail detail, uint32_t width,
                                                uint32_t height, std::string *why_not);
  // Draws into the window's back buffer; does not swap. What its owner draws afterwards lies above it.
  virtual bool show(const Scene &scene, std::string *why_not = nullptr) = 0;
  virtual void read_window(Image &picture) = 0;  // the back buffer as it is now
};

struct Color { float r, g, b; };
// Distinct colors for bodies, repeating after ten.
Color palette(uint32_t i);
// t is clamped to 0..1.
Color map_color(ColorMap map, float t);

// Through a temporary file and a rename, so that a partial picture is never read. False: *why_not
// is one sentence.
bool write_png(const std::string &path, const Image &picture, std::string *why_not);
bool read_png(const std::string &path, Image &picture, std::string *why_not);

// Text (ASCII; our own stroke font, anti-aliased). `size` is the height of a capital in pixels; x, y the left
// end of its base line.
void draw_text(Image &picture, double x, double y, double size, const std::string &text, Color color);
double text_width(double size, const std::string &text);

// A bar of the map in the lower right corner with its ends, e.g. legend(p, ColorMap::ember, 0, 1.5,
// "speed", "m/s").
void legend(Image &picture, ColorMap map, double min, double max, const std::string &title,
            const std::string &unit);

// Pictures in a grid, row by row; rows may differ in length. `row_labels` are drawn to the left and
// `column_labels` above; either may be empty.
Image montage(const std::vector<std::vector<Image>> &rows, const std::vector<std::string> &row_labels,
              const std::vector<std::string> &column_labels, const std::string &title = "");

}  // namespace render
