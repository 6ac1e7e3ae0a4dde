// A window with an OpenGL 3.3 context and Dear ImGui in it. GLFW is opened at run time, so that the program
// starts without it and says what to install.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "input.h"
#include "render/render.h"

namespace view {

class Window {
 public:
  // Throws cli::Failure with one sentence where no window can be had here. hands: the user's mouse and keys
  // count; else only what draw() gets.
  static std::unique_ptr<Window> open(uint32_t width, uint32_t height, const std::string &title, bool hands);
  virtual ~Window() = default;
  // What the user did since the last call; waits for it for at most `wait` s.
  virtual std::vector<Input> poll(double wait) = 0;
  virtual bool closed() const = 0;
  virtual void size(uint32_t &width, uint32_t &height) const = 0;  // of the picture, pixels
  virtual render::SymbolOf symbol_of() const = 0;
  // A frame of the panels, which lie above what was drawn so far: begin, then ImGui calls, then end.
  virtual void begin_panels(const std::vector<Input> &inputs, double seconds) = 0;
  virtual void end_panels() = 0;
  virtual bool panels_want_mouse() const = 0;
  virtual void show() = 0;  // the back buffer
  // Seconds since the window was opened.
  virtual double now() const = 0;
};

}  // namespace view
