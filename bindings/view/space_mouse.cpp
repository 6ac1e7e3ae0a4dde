#include "space_mouse.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "held_tools.h"

namespace view {
namespace {

constexpr double kFull = 350;     // of a motion, where the mouse is pushed as far as it goes
constexpr double kTurning = 2;    // rad/s then
constexpr double kOpening = 0.8;  // rad/s of a button
constexpr double kLongest = 0.1;  // s between two reads that count
constexpr int kMotion = 1;        // of Event::type; else a button

// spnav_event of libspnav: what both of its members begin with.
union Event {
  int type;
  struct {
    int type, x, y, z, rx, ry, rz;
    unsigned period;
    int *data;
  } motion;
  struct { int type, press, number; } button;
};

}  // namespace

struct SpaceMouse::Library {
  void *handle = nullptr;
  int (*open)() = nullptr;
  int (*close)() = nullptr;
  int (*poll)(Event *) = nullptr;
  bool opened = false;
  ~Library() {
    if (opened) close();
    if (handle) dlclose(handle);
  }
};

SpaceMouse::~SpaceMouse() = default;

std::unique_ptr<SpaceMouse> SpaceMouse::open(std::string &why) {
  const char *const own = std::getenv("DEFORM_VIEW_SPNAV");
  auto library = std::make_unique<Library>();
  library->handle = dlopen(own && *own ? own : "libspnav.so.0", RTLD_NOW | RTLD_LOCAL);
  if (!library->handle) {
    why = "no 6-DOF mouse: Debian's libspnav0 is not installed";
    return nullptr;
  }
  const auto get = [&]<class F>(F &f, const char *name) {
    f = reinterpret_cast<F>(dlsym(library->handle, name));
    return f != nullptr;
  };
  if (!get(library->open, "spnav_open") || !get(library->close, "spnav_close") ||
      !get(library->poll, "spnav_poll_event")) {
    why = "no 6-DOF mouse: libspnav.so.0 lacks a function; install Debian's libspnav0";
    return nullptr;
  }
  if (library->open() != 0) {
    why = "no 6-DOF mouse: spacenavd does not answer (Debian's spacenavd)";
    return nullptr;
  }
  library->opened = true;
  std::unique_ptr<SpaceMouse> mouse(new SpaceMouse);
  mouse->library_ = std::move(library);
  return mouse;
}

void SpaceMouse::lead(const dfm_pose &from, double opening, const render::View &axes, double speed) {
  pose_ = from;
  opening_ = opening;
  right_ = axes.right;
  up_ = axes.up;
  back_ = axes.back;
  speed_ = speed;
}

dfm_device SpaceMouse::device() {
  dfm_device out = {};
  out.size = sizeof out;
  out.user = this;
  out.read = read;
  return out;
}

// False: not touched.
bool SpaceMouse::listen() {
  Event e = {};
  while (library_->poll(&e) != 0) {
    if (e.type == kMotion) {
      const int now[6] = {e.motion.x, e.motion.y, e.motion.z, e.motion.rx, e.motion.ry, e.motion.rz};
      std::copy_n(now, 6, motion_);
    } else if (e.button.number >= 0 && e.button.number < 2) {
      pressed_[e.button.number] = e.button.press != 0;
    }
  }
  return std::any_of(motion_, motion_ + 6, [](int x) { return x != 0; }) || pressed_[0] || pressed_[1];
}

// Its z goes away from the user.
dfm_status SpaceMouse::read(void *self, double t, dfm_device_sample *out) {
  SpaceMouse &m = *static_cast<SpaceMouse *>(self);
  const double dt = m.polled_ < 0 ? 0 : std::clamp(t - m.polled_, 0.0, kLongest);
  m.polled_ = t;
  if (!m.listen() || dt == 0) return DFM_DISCARD;
  double share[6];
  for (int k = 0; k < 6; ++k) share[k] = std::clamp(m.motion_[k] / kFull, -1.0, 1.0);
  const auto along = [&](const double *s) { return m.right_ * s[0] + m.up_ * s[1] - m.back_ * s[2]; };
  const render::Vec way = along(share) * (m.speed_ * dt), turn = along(share + 3) * (kTurning * dt);
  m.pose_.position[0] += way.x;
  m.pose_.position[1] += way.y;
  m.pose_.position[2] += way.z;
  const double by[3] = {turn.x, turn.y, turn.z};
  cli::turned(m.pose_.rotation, by, m.pose_.rotation);
  m.opening_ = std::clamp(m.opening_ + kOpening * dt * (int(m.pressed_[1]) - int(m.pressed_[0])), 0.0,
                          0.5 * std::numbers::pi);
  out->pose = m.pose_;
  out->opening = m.opening_;
  out->flags = DFM_DEVICE_OPENING;
  return DFM_OK;
}

}  // namespace view
