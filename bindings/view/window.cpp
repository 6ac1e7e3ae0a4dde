#include "window.h"

#include <backends/imgui_impl_opengl3.h>
#include <dlfcn.h>
#include <imgui.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "messages.h"

// clang-format off
#define VIEW_GLFW_FUNCTIONS(X) \
  X(Init) X(Terminate) X(GetError) X(WindowHint) X(CreateWindow) X(DestroyWindow) X(MakeContextCurrent) \
  X(GetProcAddress) X(SwapInterval) X(SwapBuffers) X(PollEvents) X(WaitEventsTimeout) X(WindowShouldClose) \
  X(GetFramebufferSize) X(GetWindowSize) X(GetWindowContentScale) X(SetKeyCallback) \
  X(SetMouseButtonCallback) X(SetCursorPosCallback) X(SetScrollCallback) X(GetTime) X(GetKeyName)
// clang-format on

namespace view {
namespace {

struct Glfw {
#define X(name) decltype(&glfw##name) name = nullptr;
  VIEW_GLFW_FUNCTIONS(X)
#undef X
};

[[noreturn]] void refuse(const std::string &sentence) {
  throw cli::Failure(cli::kBadInput, "view: " + sentence);
}

Glfw open_glfw() {
  const char *const own = std::getenv("DEFORM_VIEW_GLFW");
  void *const library = dlopen(own && *own ? own : "libglfw.so.3", RTLD_NOW | RTLD_LOCAL);
  if (!library) refuse("libglfw.so.3 cannot be loaded: install Debian's libglfw3");
  Glfw glfw;
  const auto get = [&]<class F>(F &f, const char *name) {
    f = reinterpret_cast<F>(dlsym(library, name));
    if (!f) refuse(std::string("libglfw.so.3 has no ") + name + ": install Debian's libglfw3, 3.3 or later");
  };
#define X(name) get(glfw.name, "glfw" #name);
  VIEW_GLFW_FUNCTIONS(X)
#undef X
  return glfw;
}

const std::string kWays[] = {"left", "right", "up", "down", "pageup", "pagedown"};

// What the layout puts on a key that prints. GLFW's own letters are places on a US keyboard, for layouts
// without Latin letters.
std::string key_name(const Glfw &glfw, int key, int scancode, int mods) {
  const char *const printed = key < GLFW_KEY_ESCAPE ? glfw.GetKeyName(key, scancode) : nullptr;
  if (printed && static_cast<unsigned char>(*printed) < 0x80 && !printed[1])
    return (*printed >= 'a' && *printed <= 'z') || *printed == '.' ? printed : "";
  if (key >= GLFW_KEY_A && key <= GLFW_KEY_Z) return std::string(1, char('a' + key - GLFW_KEY_A));
  if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F12) return "f" + std::to_string(key - GLFW_KEY_F1 + 1);
  static const struct {
    int key;
    const char *name;
  } kNames[] = {{GLFW_KEY_SPACE, "space"}, {GLFW_KEY_ESCAPE, "escape"},     {GLFW_KEY_LEFT, "left"},
                {GLFW_KEY_RIGHT, "right"}, {GLFW_KEY_HOME, "home"},         {GLFW_KEY_PERIOD, "."},
                {GLFW_KEY_UP, "up"},       {GLFW_KEY_DOWN, "down"},         {GLFW_KEY_PAGE_UP, "pageup"},
                {GLFW_KEY_TAB, "tab"},     {GLFW_KEY_PAGE_DOWN, "pagedown"}};
  for (const auto &k : kNames) {
    if (k.key != key) continue;
    const bool way = std::find(std::begin(kWays), std::end(kWays), k.name) != std::end(kWays);
    return (way && (mods & GLFW_MOD_SHIFT) ? "shift+" : "") + std::string(k.name);
  }
  return "";
}

// Held, a key that moves something goes on; what switches or writes does so once.
bool repeats(const std::string &name) {
  const std::string way = name.starts_with("shift+") ? name.substr(6) : name;
  return way == "s" || way == "." || way == "j" || way == "k" ||
         std::find(std::begin(kWays), std::end(kWays), way) != std::end(kWays);
}

// ImGui's own is a bitmap of 13 pixels; a machine with a desktop has one of these.
void add_font(float scale) {
  ImGuiIO &io = ImGui::GetIO();
  for (const char *file : {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                           "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf"})
    if (access(file, R_OK) == 0 && io.Fonts->AddFontFromFileTTF(file, 14 * scale)) return;
  ImFontConfig plain;
  plain.SizePixels = float(int(13 * scale));
  io.Fonts->AddFontDefault(&plain);
}

class GlfwWindow final : public Window {
 public:
  GlfwWindow(uint32_t width, uint32_t height, const std::string &title, bool hands) : glfw_(open_glfw()) {
    if (!glfw_.Init()) refuse("no display: " + reason() + kRemedy);
    glfw_.WindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfw_.WindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfw_.WindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfw_.WindowHint(GLFW_SAMPLES, 0);
    if (!hands) glfw_.WindowHint(GLFW_RESIZABLE, GLFW_FALSE);
    window_ = glfw_.CreateWindow(int(width), int(height), title.c_str(), nullptr, nullptr);
    if (!window_) {
      const std::string why = reason();
      glfw_.Terminate();
      refuse("no window with OpenGL 3.3: " + why + ": install Debian's libgl1-mesa-dri");
    }
    glfw_.MakeContextCurrent(window_);
    glfw_.SwapInterval(hands ? 1 : 0);
    if (hands) listen();
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;  // panels have their place; nothing is written to the folder
    float scale = 1, unused = 1;
    if (hands) glfw_.GetWindowContentScale(window_, &scale, &unused);
    add_font(scale);
    ImGui::GetStyle().ScaleAllSizes(scale);
    if (!ImGui_ImplOpenGL3_Init("#version 330"))
      refuse("Dear ImGui finds no OpenGL: install Debian's libgl1");
  }

  ~GlfwWindow() override {
    if (ImGui::GetCurrentContext()) {
      ImGui_ImplOpenGL3_Shutdown();
      ImGui::DestroyContext();
    }
    glfw_.DestroyWindow(window_);
    glfw_.Terminate();
  }
  GlfwWindow(const GlfwWindow &) = delete;
  GlfwWindow &operator=(const GlfwWindow &) = delete;

  std::vector<Input> poll(double wait) override {
    inputs_.clear();
    if (wait > 0) glfw_.WaitEventsTimeout(wait);
    else glfw_.PollEvents();
    return inputs_;
  }
  bool closed() const override { return glfw_.WindowShouldClose(window_); }
  void size(uint32_t &width, uint32_t &height) const override {
    int w = 0, h = 0;
    glfw_.GetFramebufferSize(window_, &w, &h);
    width = uint32_t(std::max(w, 0));
    height = uint32_t(std::max(h, 0));
  }
  render::SymbolOf symbol_of() const override { return glfw_.GetProcAddress; }

  void begin_panels(const std::vector<Input> &inputs, double seconds) override {
    ImGuiIO &io = ImGui::GetIO();
    uint32_t w = 0, h = 0;
    size(w, h);
    io.DisplaySize = {float(w), float(h)};
    io.DeltaTime = float(std::max(seconds, 1e-5));
    for (const Input &in : inputs) feed(io, in);
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
  }
  void end_panels() override {
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  }
  bool panels_want_mouse() const override { return ImGui::GetIO().WantCaptureMouse; }
  void show() override { glfw_.SwapBuffers(window_); }
  double now() const override { return glfw_.GetTime(); }

 private:
  static constexpr const char *kRemedy = "; start it on a desktop, or under `xvfb-run -a` (Debian's xvfb)";

  std::string reason() const {
    const char *text = nullptr;
    glfw_.GetError(&text);
    return text ? text : "GLFW gives no reason";
  }

  static void feed(ImGuiIO &io, const Input &in) {
#if IMGUI_VERSION_NUM >= 18700
    if (in.kind == Input::wheel) io.AddMouseWheelEvent(0, float(in.turns));
    else if (in.kind != Input::key) io.AddMousePosEvent(float(in.x), float(in.y));
    if (in.kind == Input::press || in.kind == Input::release)
      io.AddMouseButtonEvent(in.button, in.kind == Input::press);
#else
    if (in.kind == Input::wheel) io.MouseWheel += float(in.turns);
    else if (in.kind != Input::key) io.MousePos = {float(in.x), float(in.y)};
    if (in.kind == Input::press || in.kind == Input::release)
      io.MouseDown[in.button] = in.kind == Input::press;
#endif
  }

  void add(Input in) {
    in.x = x_;
    in.y = y_;
    inputs_.push_back(in);
  }
  // GLFW's callbacks carry no object that is accessible without GLFW's table; a program has one window.
  static GlfwWindow &of(GLFWwindow *) { return *one_; }

  void listen() {
    one_ = this;
    glfw_.SetKeyCallback(window_, [](GLFWwindow *w, int key, int scancode, int action, int mods) {
      const std::string name = key_name(of(w).glfw_, key, scancode, mods);
      if (name.empty() || action == GLFW_RELEASE || (action == GLFW_REPEAT && !repeats(name))) return;
      Input in;
      in.kind = Input::key;
      in.name = name;
      of(w).add(in);
    });
    glfw_.SetCursorPosCallback(window_, [](GLFWwindow *w, double x, double y) {
      GlfwWindow &self = of(w);
      int wide = 1, high = 1, pixels = 1, rows = 1;
      self.glfw_.GetWindowSize(w, &wide, &high);
      self.glfw_.GetFramebufferSize(w, &pixels, &rows);
      self.x_ = x * pixels / std::max(wide, 1);
      self.y_ = y * rows / std::max(high, 1);
      self.add({});
    });
    glfw_.SetMouseButtonCallback(window_, [](GLFWwindow *w, int button, int action, int) {
      if (button > kMiddle) return;
      Input in;
      in.kind = action == GLFW_PRESS ? Input::press : Input::release;
      in.button = button;
      of(w).add(in);
    });
    glfw_.SetScrollCallback(window_, [](GLFWwindow *w, double, double turns) {
      Input in;
      in.kind = Input::wheel;
      in.turns = turns;
      of(w).add(in);
    });
  }

  static inline GlfwWindow *one_ = nullptr;
  Glfw glfw_;
  GLFWwindow *window_ = nullptr;
  double x_ = 0, y_ = 0;
  std::vector<Input> inputs_;
};

}  // namespace

std::unique_ptr<Window> Window::open(uint32_t width, uint32_t height, const std::string &title, bool hands) {
  return std::make_unique<GlfwWindow>(width, height, title, hands);
}

}  // namespace view
