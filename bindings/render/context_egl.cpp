// EGL on Mesa's surfaceless platform: no display server, no window, no pixel buffer; we draw into our own
// framebuffer object.
#include "context.h"

#ifdef RENDER_HAVE_EGL
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>

#include <cstring>
#include <mutex>

namespace render {
namespace {

constexpr const char *kPackages = "install Debian's libegl1 and libegl-mesa0";

// One display for the process: eglTerminate would end the contexts of every other renderer, so it
// is never called.
struct Egl {
  PFNEGLGETPROCADDRESSPROC get_proc_address = nullptr;
  PFNEGLBINDAPIPROC bind_api = nullptr;
  PFNEGLCREATECONTEXTPROC create_context = nullptr;
  PFNEGLDESTROYCONTEXTPROC destroy_context = nullptr;
  PFNEGLMAKECURRENTPROC make_current = nullptr;
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLConfig config = nullptr;
  std::string why_not;
};

bool has_word(const char *list, const char *word) {
  if (!list) return false;
  const size_t n = std::strlen(word);
  for (const char *p = list; (p = std::strstr(p, word)); p += n)
    if ((p == list || p[-1] == ' ') && (p[n] == ' ' || p[n] == 0)) return true;
  return false;
}

void open_display(Egl &egl) {
  void *library = open_library("DEFORM_RENDER_EGL", {"libEGL.so.1", "libEGL.so"});
  if (!library) {
    egl.why_not = std::string("EGL: libEGL.so.1 cannot be loaded: ") + kPackages;
    return;
  }
  egl.get_proc_address = reinterpret_cast<PFNEGLGETPROCADDRESSPROC>(dlsym(library, "eglGetProcAddress"));
  const auto get = [&]<class F>(F &f, const char *name) {
    f = reinterpret_cast<F>(dlsym(library, name));
    return f != nullptr;
  };
  PFNEGLQUERYSTRINGPROC query_string;
  PFNEGLINITIALIZEPROC initialize;
  PFNEGLCHOOSECONFIGPROC choose_config;
  if (!egl.get_proc_address || !get(query_string, "eglQueryString") || !get(initialize, "eglInitialize") ||
      !get(choose_config, "eglChooseConfig") || !get(egl.bind_api, "eglBindAPI") ||
      !get(egl.create_context, "eglCreateContext") || !get(egl.destroy_context, "eglDestroyContext") ||
      !get(egl.make_current, "eglMakeCurrent")) {
    egl.why_not = std::string("EGL: libEGL.so.1 lacks functions of EGL 1.4: ") + kPackages;
    return;
  }
  const auto get_platform_display =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(egl.get_proc_address("eglGetPlatformDisplayEXT"));
  if (!get_platform_display ||
      !has_word(query_string(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_MESA_platform_surfaceless")) {
    egl.why_not = std::string("EGL: no surfaceless platform (Mesa's driver is missing): ") + kPackages;
    return;
  }
  const EGLDisplay display =
      get_platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display == EGL_NO_DISPLAY || !initialize(display, nullptr, nullptr)) {
    egl.why_not =
        "EGL: Mesa's surfaceless platform does not start: install Debian's libegl-mesa0 and libgl1-mesa-dri";
    return;
  }
  // A surfaceless display has no window configurations; the surface type must be named as "any".
  const EGLint wanted[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLint n = 0;
  // EGL_NO_CONFIG_KHR: fine where it is offered
  if (!choose_config(display, wanted, &egl.config, 1, &n) || n < 1) egl.config = nullptr;
  egl.display = display;
}

Egl &shared_egl() {
  static Egl egl;
  static std::once_flag once;
  std::call_once(once, [] { open_display(egl); });
  return egl;
}

class EglContext final : public Context {
 public:
  EglContext(Egl &egl, EGLContext context) : egl_(egl), context_(context) {}
  ~EglContext() override { egl_.destroy_context(egl_.display, context_); }
  bool make_current() override {
    return egl_.bind_api(EGL_OPENGL_API) &&
           egl_.make_current(egl_.display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_);
  }
  void release() override { egl_.make_current(egl_.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }
  Symbol symbol(const char *name) const override { return egl_.get_proc_address(name); }
  const char *name() const override { return "egl"; }

 private:
  Egl &egl_;
  EGLContext context_;
};

}  // namespace

std::unique_ptr<Context> create_egl(std::string *why_not) {
  Egl &egl = shared_egl();
  if (egl.display == EGL_NO_DISPLAY) {
    *why_not = egl.why_not;
    return nullptr;
  }
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                               3,
                               EGL_CONTEXT_MINOR_VERSION,
                               3,
                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                               EGL_NONE};
  const EGLContext context = egl.bind_api(EGL_OPENGL_API)
                                 ? egl.create_context(egl.display, egl.config, EGL_NO_CONTEXT, attributes)
                                 : EGL_NO_CONTEXT;
  if (context == EGL_NO_CONTEXT) {
    *why_not = "EGL: no OpenGL 3.3 core context: install Debian's libgl1-mesa-dri";
    return nullptr;
  }
  return std::make_unique<EglContext>(egl, context);
}

}  // namespace render
#else
namespace render {
std::unique_ptr<Context> create_egl(std::string *why_not) {
  *why_not = "EGL: left out when this program was built: install Debian's libegl-dev and build again";
  return nullptr;
}
}  // namespace render
#endif
