// Those who see a scene from elsewhere, whatever carries the messages to them: the server of `deform serve`,
// or the page itself where the scene runs in its browser.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace live {

using Bytes = std::vector<unsigned char>;

// A text that the viewer in control has sent.
struct Request {
  uint32_t viewer;
  std::string text;
};

class Viewers {
 public:
  virtual ~Viewers() = default;
  // whole: for viewers that come later; changed: for those that have all before it, empty: these take the
  // whole as well.
  virtual void show_scene(Bytes whole, Bytes changed) = 0;
  // One packet as cli::Teller has it, whose memory is exchanged for that of an older one; a slow viewer gets
  // the newest one alone.
  virtual void show_frame(Bytes &frame) = 0;
  virtual void show_state(std::string json) = 0;
  virtual std::vector<Request> take() = 0;
  virtual uint32_t viewers() const = 0;
  virtual uint32_t in_control() const = 0;  // number of that viewer; 0: there is none
};

}  // namespace live
