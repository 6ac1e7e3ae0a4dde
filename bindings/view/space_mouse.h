// A mouse of six degrees of freedom as a device of a tool (dfm_device): Debian's libspnav0, a client of the
// daemon spacenavd, opened at run time.
#pragma once
#include <memory>
#include <string>

#include "cli.h"
#include "render/geometry.h"

namespace view {

class SpaceMouse {
 public:
  // None: `why` is a sentence.
  static std::unique_ptr<SpaceMouse> open(std::string &why);
  ~SpaceMouse();
  SpaceMouse(const SpaceMouse &) = delete;
  SpaceMouse &operator=(const SpaceMouse &) = delete;

  // From where it leads on, and what its right, up and towards the user are; speed: m/s where it is pushed as
  // far as it goes.
  void lead(const dfm_pose &from, double opening, const render::View &axes, double speed);
  // read() moves on for the time since its last call; DFM_DISCARD if the mouse is not touched. The two
  // buttons close and open jaws.
  dfm_device device();

 private:
  struct Library;
  SpaceMouse() = default;
  static dfm_status read(void *self, double t, dfm_device_sample *out);
  bool listen();

  std::unique_ptr<Library> library_;
  dfm_pose pose_ = {};
  double opening_ = 0, speed_ = 0, polled_ = -1;
  render::Vec right_, up_, back_;
  int motion_[6] = {0, 0, 0, 0, 0, 0};  // the last values
  bool pressed_[2] = {false, false};
};

}  // namespace view
