// One picture: everything becomes triangles (geometry.cpp), the shadow maps of the key light and of the sky
// are drawn, then background, floor, bodies, values that these hide, what is seen through (far to near),
// lines; four samples a pixel are resolved and read back.
#include "render.h"

#include <algorithm>
#include <cfenv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numbers>

#include "geometry.h"
#include "gl.h"
#include "hidden.h"
#include "shaders.h"

namespace render {
namespace {

constexpr int kKeySide = 1536, kSkySide = 160, kSamples = 4;
constexpr uint32_t kLargest = 8192;

// What host code set for its own arithmetic (rounding, traps) stays as it was: a picture may not change a
// simulation's bits.
struct FloatingPoint {
  std::fenv_t saved;
  FloatingPoint() {
    std::fegetenv(&saved);
    std::fesetenv(FE_DFL_ENV);
  }
  ~FloatingPoint() { std::fesetenv(&saved); }
};

struct Current {
  Context &context;
  bool ok;
  explicit Current(Context &c) : context(c), ok(c.make_current()) {}
  ~Current() { context.release(); }
};

struct Batch {
  GLint first = 0;
  GLsizei count = 0;
  Kind kind = Kind::lit;
  float alpha = 1;
  bool shadow = true, on_top = false;
  double depth = 0;  // of its middle, for the order of what is seen through
};

struct Ground {
  Vec center, x, y;
  double spacing, radius;
  bool present = false;
};

struct Frame {
  Shape shape;
  std::vector<Batch> batches;
  Ground ground;
  View view;
  Vec up, key;
  Vec center;         // of the casters, relative to the origin
  double radius = 1;  // of the casters
  double extent = 1;  // half the diagonal of what grid and slabs are sized to
};

constexpr float kVeil = 0.4f;  // of the floor's alpha, from below

double nice(double x) {  // 1, 2 or 5 times a power of ten, not above x
  const double base = std::pow(10, std::floor(std::log10(x))), m = x / base;
  return base * (m >= 5 ? 5 : m >= 2 ? 2 : 1);
}

std::string check(const Scene &scene) {
  const auto number = [](size_t i) { return std::to_string(i); };
  for (size_t b = 0; b < scene.surfaces.size(); ++b) {
    const Surface &s = scene.surfaces[b];
    for (size_t i = 0; i < 3 * size_t(s.ntri); ++i)
      if (s.tri[i] >= s.n)
        return "surface " + number(b) + ": triangle " + number(i / 3) + " names vertex " + number(s.tri[i]) +
               " of " + number(s.n);
  }
  if (scene.camera && !(finite(vec(scene.camera->eye)) && finite(vec(scene.camera->look_at))))
    return "camera: eye and look_at must be finite numbers";
  return {};
}

// Appends what `add` draws as one batch.
template <class F>
void batch(Frame &frame, Batch b, F add) {
  std::vector<Vertex> &v = frame.shape.vertices;
  b.first = GLint(v.size());
  add();
  b.count = GLsizei(v.size()) - b.first;
  if (b.count == 0) return;
  Vec middle;
  for (size_t i = size_t(b.first); i < v.size(); ++i) middle = middle + Vec{v[i].p[0], v[i].p[1], v[i].p[2]};
  b.depth = dot(frame.view.eye - middle * (1.0 / b.count), frame.view.back);
  frame.batches.push_back(b);
}

Batch solid(const Look &look, float shown = 1) {
  Batch b;
  b.alpha = std::clamp(look.alpha, 0.f, 1.f) * shown;
  b.shadow = look.alpha >= 1;
  return b;
}

void add_planes(const Scene &scene, Frame &frame, const Bounds &extent) {
  Bounds reached = extent;  // slabs go on under what has left it
  if (const Bounds now = bounds(scene); !now.empty()) {
    reached.add(now.lo);
    reached.add(now.hi);
  }
  const Bounds room = room_of(scene, frame.up, reached);
  const Vec middle = (vec(extent.lo) + vec(extent.hi)) * 0.5;
  const Plane *floor = nullptr;
  for (const Plane &p : scene.planes) {
    const Vec n = unit(vec(p.normal), frame.up);
    const Vec eye = frame.view.eye + frame.shape.origin;
    if (!p.slab && dot(n, frame.up) > kLevel) {
      if (!floor || dot(vec(p.point) - vec(floor->point), frame.up) > 0) floor = &p;
      continue;
    }
    if (dot(n, eye - vec(p.point)) <= 0) continue;
    batch(frame, solid(p.look), [&] {
      const Slab s = slab_of(p, frame.up, room);
      frame.shape.box(s.center, s.axes, p.look.rgb);
    });
  }
  if (!floor) return;
  Ground &g = frame.ground;
  g.present = true;
  // It lies where the line of sight meets it, and reaches far beyond that, wherever the camera has gone.
  const Vec eye = frame.view.eye + frame.shape.origin;
  const double height = dot(eye - vec(floor->point), frame.up), above = std::abs(height);
  const double falls = std::abs(dot(frame.view.back, frame.up));
  const double way = std::min(above / std::max(falls, 0.05), 20 * frame.extent + above);
  g.radius = std::max(6 * frame.extent, 6 * way);
  g.spacing = nice(0.45 * frame.extent);
  g.x = square_to(frame.up);
  g.y = cross(frame.up, g.x);
  // The pattern is fixed to the world, not to the middle of the scene, so it does not move between frames.
  const Vec level = vec(floor->point) + frame.up * 1e-9;
  const Vec sight = scene.camera ? eye - frame.view.back * way : middle;
  const Vec foot = sight + frame.up * dot(frame.up, level - sight);
  const double two = 2 * g.spacing;
  const auto beyond = [&](const Vec &axis) {
    return axis * (dot(foot, axis) - two * std::round(dot(foot, axis) / two));
  };
  const Vec snapped = foot - beyond(g.x) - beyond(g.y);
  g.center = snapped - frame.shape.origin;
  Batch b;
  b.kind = Kind::floor;
  b.shadow = false;
  b.alpha = floor->look.alpha * (height > 0 ? 1 : kVeil);
  // Looks of obstacles are gray by default; a floor is lighter, so that shadows have room to fall.
  const bool own = !std::equal(floor->look.rgb, floor->look.rgb + 3, Look{}.rgb);
  const float light[3] = {0.90f, 0.905f, 0.915f};
  batch(frame, b, [&] {
    const Vec x = g.x * g.radius, y = g.y * g.radius;
    const Vec corner[4] = {snapped - x - y, snapped + x - y, snapped + x + y, snapped - x + y};
    const Vec n[4] = {frame.up, frame.up, frame.up, frame.up};
    frame.shape.quad(corner, n, own ? floor->look.rgb : light);
  });
}

// The triangles with values once more, to be drawn where something hides them.
void add_values(const Surface &s, Frame &frame) {
  std::vector<uint32_t> valued;
  for (size_t t = 0; t < 3 * size_t(s.ntri); t += 3)
    if (!std::isnan(s.scalar[s.tri[t]]) || !std::isnan(s.scalar[s.tri[t + 1]]) ||
        !std::isnan(s.scalar[s.tri[t + 2]]))
      valued.insert(valued.end(), s.tri + t, s.tri + t + 3);
  Surface part = s;
  part.tri = valued.data();
  part.ntri = uint32_t(valued.size() / 3);
  Batch b;
  b.kind = Kind::through;
  b.alpha = s.through;
  b.shadow = false;
  batch(frame, b, [&] { frame.shape.surface(part); });
}

// Ball around what casts shadows and lies in the box (floors cast none).
void fit_casters(Frame &frame, const Bounds &box) {
  Bounds all;
  const double reach = norm(vec(box.hi) - vec(box.lo));
  for (const Batch &b : frame.batches)
    if (b.shadow && b.kind == Kind::lit)
      for (GLint i = b.first; i < b.first + b.count; ++i) {
        const float *q = frame.shape.vertices[size_t(i)].p;
        double p[3] = {q[0], q[1], q[2]};
        const double *o = &frame.shape.origin.x;
        for (int k = 0; k < 3; ++k)
          p[k] = std::clamp(p[k], box.lo[k] - o[k] - 0.5 * reach, box.hi[k] - o[k] + 0.5 * reach);
        all.add(p);
      }
  if (all.empty()) return;
  frame.center = (vec(all.lo) + vec(all.hi)) * 0.5;
  frame.radius = std::max(0.5 * norm(vec(all.hi) - vec(all.lo)), 1e-9);
}

Frame compose(const Scene &scene, double aspect, double pixels_high) {
  Frame frame;
  const Bounds extent = extent_of(scene);
  Vec middle = (vec(extent.lo) + vec(extent.hi)) * 0.5;
  frame.extent = std::max(0.5 * norm(vec(extent.hi) - vec(extent.lo)), 1e-6);
  frame.up = unit(vec(scene.up));
  // Single precision holds what is near: where all has left the extent, the origin goes with it.
  const Bounds now = bounds(scene);
  const Vec place = now.empty() ? middle : (vec(now.lo) + vec(now.hi)) * 0.5;
  if (norm(place - middle) > 2 * frame.extent) middle = place;
  frame.shape.origin = middle;
  frame.view = view_of(scene.camera ? *scene.camera : auto_camera(scene, aspect));
  frame.view.eye = frame.view.eye - middle;
  const Vec level = unit(frame.view.back - frame.up * dot(frame.view.back, frame.up), frame.view.up);
  frame.key = unit(frame.up * 1.15 - frame.view.right * 0.62 + level * 0.55);

  for (const Surface &s : scene.surfaces) {
    batch(frame, {}, [&] { frame.shape.surface(s); });
    if (s.scalar && s.through > 0) add_values(s, frame);
  }
  const Hidden hidden(scene, frame.view.eye + middle);
  for (const Box &b : scene.boxes)
    batch(frame, solid(b.look, hidden.shown(b)), [&] {
      Vec axes[3];
      axes_of(b, axes);
      frame.shape.box(vec(b.pose.position), axes, b.look.rgb);
    });
  for (const Sphere &s : scene.spheres)
    batch(frame, solid(s.look, hidden.shown(s)), [&] { frame.shape.sphere(s); });
  for (const Capsule &c : scene.capsules)
    batch(frame, solid(c.look, hidden.shown(c)), [&] { frame.shape.capsule(c); });
  add_planes(scene, frame, extent);
  fit_casters(frame, now.empty() ? extent : now);
  View world = frame.view;
  world.eye = world.eye + middle;
  for (const Lines &l : scene.lines) {
    Batch b;
    b.kind = Kind::plain;
    b.shadow = false;
    b.on_top = l.on_top;
    batch(frame, b, [&] { frame.shape.ribbons(l, world, pixels_high); });
  }
  // The floor first (it fades into the background; from below it is before everything), then what hides, the
  // values behind that, then what is seen through from far to near, lines last.
  const double above = frame.ground.present ? dot(frame.view.eye - frame.ground.center, frame.up) : 0;
  const auto rank = [above](const Batch &b) {
    switch (b.kind) {
      case Kind::floor: return above > 0 ? 0 : 4;
      case Kind::through: return 2;
      case Kind::plain: return 5 + b.on_top;
      default: return b.alpha >= 1 ? 1 : 3;
    }
  };
  std::stable_sort(frame.batches.begin(), frame.batches.end(), [&](const Batch &a, const Batch &b) {
    return rank(a) != rank(b) ? rank(a) < rank(b) : rank(a) == 3 && a.depth > b.depth;
  });
  return frame;
}

// Directions of the sky: a sunflower over the upper half ball, kept 8 degrees clear of the horizon.
std::vector<Vec> sky_directions(const Vec &up, int lights) {
  std::vector<Vec> d(static_cast<size_t>(lights));
  const Vec x = square_to(up), y = cross(up, x);
  for (int i = 0; i < lights; ++i) {
    const double z = 1 - (i + 0.5) / lights * 0.86, r = std::sqrt(1 - z * z), a = 2.399963229728653 * i;
    d[size_t(i)] = up * z + x * (r * std::cos(a)) + y * (r * std::sin(a));
  }
  return d;
}

// A window's GL: its owner keeps it current.
class WindowContext final : public Context {
 public:
  explicit WindowContext(SymbolOf symbol_of) : symbol_of_(symbol_of) {}
  bool make_current() override { return true; }
  void release() override {}
  Symbol symbol(const char *name) const override { return symbol_of_(name); }
  const char *name() const override { return "window"; }

 private:
  SymbolOf symbol_of_;
};

// The fragment shader with another number in one of its constants.
std::string with(std::string text, const std::string &constant, int number) {
  const size_t at = text.find(constant) + constant.rfind(' ') + 1;
  return text.replace(at, text.find(';', at) - at, std::to_string(number));
}

constexpr int kKinds = 4;

class GlRenderer final : public WindowRenderer {
 public:
  GlRenderer(std::unique_ptr<Context> context, Detail detail, uint32_t width, uint32_t height)
      : context_(std::move(context)),
        width_(width),
        height_(height),
        sky_lights_(detail == Detail::full ? kSkyLights : kSkyLights / 8),
        samples_(detail == Detail::full ? kSamples : 0) {}
  ~GlRenderer() override;
  bool start(std::string *why_not);
  bool draw(const Scene &scene, Image &picture, std::string *why_not) override;
  bool show(const Scene &scene, std::string *why_not) override;
  void read_window(Image &picture) override;
  const char *backend() const override { return context_->name(); }
  const char *device() const override { return device_.c_str(); }

 private:
  GLuint program(const char *vertex, const char *fragment, std::string *why_not);
  bool make_targets(std::string *why_not);
  GLuint depth_map(GLenum target, int side, int layers);
  void set(const char *name, const Vec &v) const;
  void set(const char *name, const Mat4 &m) const {
    gl_.UniformMatrix4fv(gl_.GetUniformLocation(current_, name), 1, GL_FALSE, m.data());
  }
  void set(const char *name, int i) const { gl_.Uniform1i(gl_.GetUniformLocation(current_, name), i); }
  void set(const char *name, double x) const {
    gl_.Uniform1f(gl_.GetUniformLocation(current_, name), float(x));
  }
  void use(GLuint program) {
    current_ = program;
    gl_.UseProgram(program);
  }
  void upload(const Frame &frame, ColorMap map);
  // Into the sampled target. False: the sentence is in *why_not.
  bool paint(const Scene &scene, std::string *why_not);
  bool without_error(std::string *why_not) const;
  void draw_shadows(const Frame &frame, const Mat4 &key, const std::vector<Mat4> &sky);
  void draw_colors(const Frame &frame, const Mat4 &key, const std::vector<Mat4> &sky,
                   const std::vector<Vec> &directions);
  void light(const Frame &frame, const Mat4 &key, const std::vector<Mat4> &sky,
             const std::vector<Vec> &directions) const;
  void resolve();
  void read(Image &picture);

  std::unique_ptr<Context> context_;
  Gl gl_;
  std::string device_;
  uint32_t width_, height_;
  int sky_lights_, samples_;
  bool started_ = false;
  GLuint main_[kKinds] = {}, depth_ = 0, background_ = 0, current_ = 0;
  GLuint array_ = 0, buffer_ = 0, key_texture_ = 0, sky_texture_ = 0, map_texture_ = 0;
  GLuint shadow_target_ = 0, sampled_target_ = 0, resolved_target_ = 0, stores_[3] = {0, 0, 0};
  std::vector<uint8_t> rgba_;
};

GlRenderer::~GlRenderer() {
  if (!started_) return;
  Current current(*context_);
  if (!current.ok) return;
  for (const GLuint p : main_) gl_.DeleteProgram(p);
  for (const GLuint p : {depth_, background_}) gl_.DeleteProgram(p);
  for (const GLuint t : {key_texture_, sky_texture_, map_texture_}) gl_.DeleteTextures(1, &t);
  for (const GLuint f : {shadow_target_, sampled_target_, resolved_target_}) gl_.DeleteFramebuffers(1, &f);
  gl_.DeleteRenderbuffers(3, stores_);
  gl_.DeleteBuffers(1, &buffer_);
  gl_.DeleteVertexArrays(1, &array_);
}

GLuint GlRenderer::program(const char *vertex, const char *fragment, std::string *why_not) {
  const GLuint p = gl_.CreateProgram();
  for (const auto &[type, source] :
       {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
    const GLuint s = gl_.CreateShader(GLenum(type));
    gl_.ShaderSource(s, 1, &source, nullptr);
    gl_.CompileShader(s);
    GLint ok = 0;
    gl_.GetShaderiv(s, GL_COMPILE_STATUS, &ok);
    if (!ok) {
      char log[1024] = "";
      gl_.GetShaderInfoLog(s, sizeof log, nullptr, log);
      *why_not = std::string(context_->name()) + ": " + device_ + " refuses a shader: " + log;
    }
    gl_.AttachShader(p, s);
    gl_.DeleteShader(s);
    if (!ok) return 0;
  }
  const char *names[] = {"position", "normal", "color", "value"};
  for (GLuint i = 0; i < 4; ++i) gl_.BindAttribLocation(p, i, names[i]);
  gl_.LinkProgram(p);
  GLint ok = 0;
  gl_.GetProgramiv(p, GL_LINK_STATUS, &ok);
  if (!ok) *why_not = std::string(context_->name()) + ": " + device_ + " cannot link a shader";
  return ok ? p : 0;
}

GLuint GlRenderer::depth_map(GLenum target, int side, int layers) {
  GLuint t = 0;
  gl_.GenTextures(1, &t);
  gl_.BindTexture(target, t);
  if (target == GL_TEXTURE_2D)
    gl_.TexImage2D(target, 0, GL_DEPTH_COMPONENT24, side, side, 0, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT,
                   nullptr);
  else
    gl_.TexImage3D(target, 0, GL_DEPTH_COMPONENT24, side, side, layers, 0, GL_DEPTH_COMPONENT,
                   GL_UNSIGNED_INT, nullptr);
  const float lit[4] = {1, 1, 1, 1};  // outside the map nothing blocks the light
  gl_.TexParameterfv(target, GL_TEXTURE_BORDER_COLOR, lit);
  gl_.TexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  gl_.TexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  gl_.TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl_.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl_.TexParameteri(target, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  gl_.TexParameteri(target, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  return t;
}

bool GlRenderer::make_targets(std::string *why_not) {
  gl_.ActiveTexture(GL_TEXTURE0);
  key_texture_ = depth_map(GL_TEXTURE_2D, kKeySide, 1);
  gl_.ActiveTexture(GL_TEXTURE1);
  sky_texture_ = depth_map(GL_TEXTURE_2D_ARRAY, kSkySide, sky_lights_);
  gl_.ActiveTexture(GL_TEXTURE2);
  gl_.GenTextures(1, &map_texture_);
  gl_.BindTexture(GL_TEXTURE_2D, map_texture_);
  for (const GLenum side : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    gl_.TexParameteri(GL_TEXTURE_2D, side, GL_CLAMP_TO_EDGE);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    gl_.TexParameteri(GL_TEXTURE_2D, filter, GL_LINEAR);

  GLint most = 0;
  gl_.GetIntegerv(GL_MAX_SAMPLES, &most);
  const GLsizei samples = std::min<GLsizei>(samples_, most), w = GLsizei(width_), h = GLsizei(height_);
  gl_.GenFramebuffers(1, &shadow_target_);
  gl_.GenFramebuffers(1, &sampled_target_);
  gl_.GenFramebuffers(1, &resolved_target_);
  gl_.GenRenderbuffers(3, stores_);
  const auto store = [&](int i, GLsizei n, GLenum format, GLenum point) {
    gl_.BindRenderbuffer(GL_RENDERBUFFER, stores_[i]);
    gl_.RenderbufferStorageMultisample(GL_RENDERBUFFER, n, format, w, h);
    gl_.FramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, stores_[i]);
  };
  gl_.BindFramebuffer(GL_FRAMEBUFFER, sampled_target_);
  store(0, samples, GL_RGBA8, GL_COLOR_ATTACHMENT0);
  store(1, samples, GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT);
  const bool sampled = gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  gl_.BindFramebuffer(GL_FRAMEBUFFER, resolved_target_);
  store(2, 0, GL_RGBA8, GL_COLOR_ATTACHMENT0);
  const bool resolved = gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  gl_.GenVertexArrays(1, &array_);
  gl_.BindVertexArray(array_);
  gl_.GenBuffers(1, &buffer_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, buffer_);
  const GLint widths[] = {3, 3, 3, 2};
  size_t offset = 0;
  for (GLuint i = 0; i < 4; ++i) {
    gl_.EnableVertexAttribArray(i);
    gl_.VertexAttribPointer(i, widths[i], GL_FLOAT, GL_FALSE, sizeof(Vertex),
                            reinterpret_cast<const void *>(offset));
    offset += size_t(widths[i]) * sizeof(float);
  }
  if (sampled && resolved && gl_.GetError() == GL_NO_ERROR) return true;
  *why_not = std::string(context_->name()) + ": " + device_ + " gives no picture of " +
             std::to_string(width_) + " x " + std::to_string(height_) + " pixels: ask for a smaller one";
  return false;
}

bool GlRenderer::start(std::string *why_not) {
  const FloatingPoint keep;
  Current current(*context_);
  std::string missing;
  if (!current.ok) {
    *why_not = std::string(context_->name()) +
               ": its context cannot be made current: install Debian's libgl1-mesa-dri";
    return false;
  }
  if (!gl_.load(*context_, &missing)) {
    *why_not = std::string(context_->name()) + ": the driver lacks " + missing +
               " of OpenGL 3.3: install Debian's libgl1-mesa-dri";
    return false;
  }
  const GLubyte *text = gl_.GetString(GL_RENDERER);
  device_ = text ? reinterpret_cast<const char *>(text) : "unnamed";
  started_ = true;
  const std::string fragment = with(kFragmentShader, kSkyText, sky_lights_);
  for (int kind = 0; kind < kKinds; ++kind)
    if (!(main_[kind] = program(kVertexShader, with(fragment, kKindText, kind).c_str(), why_not)))
      return false;
  return (depth_ = program(kDepthVertexShader, kDepthFragmentShader, why_not)) &&
         (background_ = program(kBackgroundVertexShader, kBackgroundFragmentShader, why_not)) &&
         make_targets(why_not);
}

void GlRenderer::set(const char *name, const Vec &v) const {
  const float f[3] = {float(v.x), float(v.y), float(v.z)};
  gl_.Uniform3fv(gl_.GetUniformLocation(current_, name), 1, f);
}

void GlRenderer::upload(const Frame &frame, ColorMap map) {
  gl_.BindVertexArray(array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, buffer_);
  gl_.BufferData(GL_ARRAY_BUFFER, GLsizeiptr(frame.shape.vertices.size() * sizeof(Vertex)),
                 frame.shape.vertices.data(), GL_STREAM_DRAW);
  uint8_t table[257][4];  // an odd number: a map may have its kink in the middle
  for (int i = 0; i < 257; ++i) {
    const Color c = map_color(map, float(i) / 256);
    const float rgb[3] = {c.r, c.g, c.b};
    for (int k = 0; k < 3; ++k) table[i][k] = uint8_t(std::lround(255 * rgb[k]));
    table[i][3] = 255;
  }
  gl_.ActiveTexture(GL_TEXTURE2);
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, 257, 1, 0, GL_RGBA, GL_UNSIGNED_BYTE, table);
}

void GlRenderer::draw_shadows(const Frame &frame, const Mat4 &key, const std::vector<Mat4> &sky) {
  gl_.BindFramebuffer(GL_FRAMEBUFFER, shadow_target_);
  gl_.DrawBuffer(GL_NONE);
  gl_.ReadBuffer(GL_NONE);
  gl_.Disable(GL_BLEND);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.Enable(GL_DEPTH_CLAMP);  // what lies before or behind the ball still casts
  gl_.Enable(GL_POLYGON_OFFSET_FILL);
  gl_.PolygonOffset(1.5f, 2.f);
  gl_.DepthFunc(GL_LEQUAL);
  gl_.DepthMask(GL_TRUE);
  use(depth_);
  const auto draw = [&](const Mat4 &to_clip, int side) {
    gl_.Viewport(0, 0, side, side);
    gl_.Clear(GL_DEPTH_BUFFER_BIT);
    set("to_clip", to_clip);
    for (const Batch &b : frame.batches)
      if (b.shadow) gl_.DrawArrays(GL_TRIANGLES, b.first, b.count);
  };
  gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, key_texture_, 0);
  draw(key, kKeySide);
  for (int i = 0; i < sky_lights_; ++i) {
    gl_.FramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, sky_texture_, 0, i);
    draw(sky[size_t(i)], kSkySide);
  }
  gl_.Disable(GL_DEPTH_CLAMP);
  gl_.Disable(GL_POLYGON_OFFSET_FILL);
}

// Values that a color program gets once per picture.
void GlRenderer::light(const Frame &frame, const Mat4 &key, const std::vector<Mat4> &sky,
                       const std::vector<Vec> &directions) const {
  const double distance = norm(frame.view.eye - frame.center);
  const double near = std::max(distance - 1.8 * frame.radius - frame.extent, 0.02 * distance + 1e-9);
  const double far =
      distance + frame.radius + (frame.ground.present ? 2 * frame.ground.radius : 0) + 4 * frame.extent;
  set("to_clip", perspective(frame.view, double(width_) / height_, near, far));
  set("eye", frame.view.eye);
  set("up", frame.up);
  set("key", frame.key);
  set("key_map", to_texture(key));
  set("key_texel", 2 * frame.radius / kKeySide);
  set("sky_texel", 2 * frame.radius / kSkySide);
  set("casters", frame.center);
  set("casters_radius", frame.radius);
  double open = 0;
  for (int i = 0; i < sky_lights_; ++i) {
    char name[24];
    std::snprintf(name, sizeof name, "sky_map[%d]", i);
    set(name, to_texture(sky[size_t(i)]));
    std::snprintf(name, sizeof name, "sky[%d]", i);
    set(name, directions[size_t(i)]);
    open += dot(directions[size_t(i)], frame.up);
  }
  set("sky_scale", 1 / open);
  set("floor_center", frame.ground.center);
  set("floor_x", frame.ground.x);
  set("floor_y", frame.ground.y);
  gl_.Uniform2f(gl_.GetUniformLocation(current_, "floor_size"), float(frame.ground.spacing),
                float(frame.ground.radius));
  set("key_shadow", 0);
  set("sky_shadow", 1);
  set("map", 2);
}

void GlRenderer::draw_colors(const Frame &frame, const Mat4 &key, const std::vector<Mat4> &sky,
                             const std::vector<Vec> &directions) {
  gl_.BindFramebuffer(GL_FRAMEBUFFER, sampled_target_);
  gl_.Viewport(0, 0, GLsizei(width_), GLsizei(height_));
  gl_.ClearColor(1, 1, 1, 1);
  gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  gl_.Disable(GL_DEPTH_TEST);
  use(background_);
  gl_.DrawArrays(GL_TRIANGLES, 0, 3);

  for (const GLuint p : main_) {
    use(p);
    light(frame, key, sky, directions);
  }
  gl_.Enable(GL_BLEND);
  gl_.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  gl_.Enable(GL_DEPTH_TEST);
  for (const Batch &b : frame.batches) {
    gl_.DepthFunc(b.on_top ? GL_ALWAYS : b.kind == Kind::through ? GL_GREATER : GL_LEQUAL);
    gl_.DepthMask(b.alpha >= 1 && !b.on_top && b.kind != Kind::through ? GL_TRUE : GL_FALSE);
    use(main_[int(b.kind)]);
    set("alpha", double(b.alpha));
    gl_.DrawArrays(GL_TRIANGLES, b.first, b.count);
  }
  gl_.DepthMask(GL_TRUE);
}

void GlRenderer::resolve() {
  const GLint w = GLint(width_), h = GLint(height_);
  gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, sampled_target_);
  gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_target_);
  gl_.BlitFramebuffer(0, 0, w, h, 0, 0, w, h, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

// Reads the framebuffer that is bound for reading.
void GlRenderer::read(Image &picture) {
  const GLint w = GLint(width_), h = GLint(height_);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
  rgba_.resize(size_t(width_) * height_ * 4);
  gl_.ReadPixels(0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, rgba_.data());
  picture.width = width_;
  picture.height = height_;
  picture.rgb.resize(size_t(width_) * height_ * 3);
  for (size_t y = 0; y < height_; ++y) {  // GL's first row is the lowest
    const uint8_t *from = rgba_.data() + (height_ - 1 - y) * width_ * 4;
    uint8_t *to = picture.rgb.data() + y * width_ * 3;
    for (size_t x = 0; x < width_; ++x) std::memcpy(to + 3 * x, from + 4 * x, 3);
  }
}

bool GlRenderer::paint(const Scene &scene, std::string *why_not) {
  *why_not = check(scene);
  if (!why_not->empty()) return false;
  const Frame frame = compose(scene, double(width_) / height_, height_);
  const std::vector<Vec> directions = sky_directions(frame.up, sky_lights_);
  const Mat4 key = orthographic(frame.key, frame.center, 1.02 * frame.radius);
  std::vector<Mat4> sky(directions.size());
  for (size_t i = 0; i < sky.size(); ++i)
    sky[i] = orthographic(directions[i], frame.center, 1.02 * frame.radius);
  upload(frame, scene.map);
  draw_shadows(frame, key, sky);
  draw_colors(frame, key, sky, directions);
  resolve();
  return true;
}

bool GlRenderer::without_error(std::string *why_not) const {
  const GLenum error = gl_.GetError();
  if (error == GL_NO_ERROR) return true;
  *why_not = std::string(context_->name()) + ": " + device_ + " refuses the picture (GL error " +
             std::to_string(error) + ")";
  return false;
}

bool GlRenderer::draw(const Scene &scene, Image &picture, std::string *why_not) {
  std::string sentence;
  const FloatingPoint keep;
  Current current(*context_);
  if (!current.ok) {
    sentence = std::string(context_->name()) + ": its context cannot be made current on this thread";
  } else if (paint(scene, &sentence)) {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, resolved_target_);
    read(picture);
    if (without_error(&sentence)) return true;
  }
  if (why_not) *why_not = sentence;
  return false;
}

bool GlRenderer::show(const Scene &scene, std::string *why_not) {
  std::string sentence;
  const FloatingPoint keep;
  if (paint(scene, &sentence)) {
    const GLint w = GLint(width_), h = GLint(height_);
    // From one sample a pixel: what has several is copied only between targets of one format.
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, resolved_target_);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    gl_.BlitFramebuffer(0, 0, w, h, 0, 0, w, h, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
    gl_.Viewport(0, 0, w, h);
    if (without_error(&sentence)) return true;
  }
  if (why_not) *why_not = sentence;
  return false;
}

void GlRenderer::read_window(Image &picture) {
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
  gl_.ReadBuffer(GL_BACK);
  read(picture);
}

bool sized(uint32_t width, uint32_t height, std::string &why) {
  if (width >= 1 && height >= 1 && width <= kLargest && height <= kLargest) return true;
  why = "a picture of " + std::to_string(width) + " x " + std::to_string(height) +
        " pixels: each side must be 1 to " + std::to_string(kLargest);
  return false;
}

}  // namespace

std::unique_ptr<Renderer> Renderer::create(Backend backend, uint32_t width, uint32_t height,
                                           std::string *why_not) {
  std::string unused;
  std::string &why = why_not ? *why_not : unused;
  if (!sized(width, height, why)) return nullptr;
  const char *wish = std::getenv("DEFORM_RENDER_BACKEND");
  if (backend == Backend::automatic && wish && *wish) {
    const std::string name = wish;
    if (name == "egl") {
      backend = Backend::egl;
    } else if (name == "osmesa") {
      backend = Backend::osmesa;
    } else if (name != "auto") {
      why = name == "none"
                ? "pictures are switched off by DEFORM_RENDER_BACKEND=none: unset it, or set it to egl or "
                  "osmesa"
                : "DEFORM_RENDER_BACKEND=" + name + " is not a backend: set it to auto, egl, osmesa or none";
      return nullptr;
    }
  }
  std::string reasons[2];
  const FloatingPoint keep;
  for (const Backend b : {Backend::egl, Backend::osmesa}) {
    if (backend != Backend::automatic && backend != b) continue;
    std::string &reason = reasons[b == Backend::osmesa];
    std::unique_ptr<Context> context = b == Backend::egl ? create_egl(&reason) : create_osmesa(&reason);
    if (!context) continue;
    auto renderer = std::make_unique<GlRenderer>(std::move(context), Detail::full, width, height);
    if (renderer->start(&reason)) return renderer;
  }
  why = reasons[0] + (reasons[0].empty() || reasons[1].empty() ? "" : "; ") + reasons[1];
  return nullptr;
}

std::unique_ptr<WindowRenderer> WindowRenderer::create(SymbolOf symbol_of, Detail detail, uint32_t width,
                                                       uint32_t height, std::string *why_not) {
  std::string unused;
  std::string &why = why_not ? *why_not : unused;
  if (!sized(width, height, why)) return nullptr;
  const FloatingPoint keep;
  auto renderer =
      std::make_unique<GlRenderer>(std::make_unique<WindowContext>(symbol_of), detail, width, height);
  if (!renderer->start(&why)) return nullptr;
  return renderer;
}

}  // namespace render
