// OSMesa: GL into main memory. Its own color buffer is a stub; we draw into our own framebuffer
// object as with EGL.
#include "context.h"

#include <dlfcn.h>

#include <cstdlib>
#include <initializer_list>

namespace render {
void *open_library(const char *variable, std::initializer_list<const char *> names) {
  const char *own = std::getenv(variable);
  if (own && *own) return dlopen(own, RTLD_NOW | RTLD_LOCAL);
  for (const char *name : names)
    if (void *library = dlopen(name, RTLD_NOW | RTLD_LOCAL)) return library;
  return nullptr;
}
}  // namespace render

#ifdef RENDER_HAVE_OSMESA
#include <GL/osmesa.h>

#include <array>
#include <mutex>

namespace render {
namespace {

struct OsMesa {
  decltype(&OSMesaCreateContextAttribs) create_context = nullptr;
  decltype(&OSMesaDestroyContext) destroy_context = nullptr;
  decltype(&OSMesaMakeCurrent) make_current = nullptr;
  decltype(&OSMesaGetProcAddress) get_proc_address = nullptr;
  bool ready = false;
};

const OsMesa &shared_osmesa() {
  static const OsMesa osmesa = [] {
    OsMesa o;
    void *library =
        open_library("DEFORM_RENDER_OSMESA", {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"});
    if (!library) return o;
    const auto get = [&]<class F>(F &f, const char *name) {
      f = reinterpret_cast<F>(dlsym(library, name));
      return f != nullptr;
    };
    o.ready = get(o.create_context, "OSMesaCreateContextAttribs") &&
              get(o.destroy_context, "OSMesaDestroyContext") && get(o.make_current, "OSMesaMakeCurrent") &&
              get(o.get_proc_address, "OSMesaGetProcAddress");
    return o;
  }();
  return osmesa;
}

// Mesa 22.3 makes contexts with data of its own that it does not lock (helgrind names
// OSMesaCreateContextAttribs), so one thread at a time makes or destroys one.
std::mutex &making() {
  static std::mutex mutex;
  return mutex;
}

class OsMesaContext final : public Context {
 public:
  OsMesaContext(const OsMesa &osmesa, OSMesaContext context) : osmesa_(osmesa), context_(context) {}
  ~OsMesaContext() override {
    const std::lock_guard lock(making());
    osmesa_.destroy_context(context_);
  }
  bool make_current() override {
    return osmesa_.make_current(context_, buffer_.data(), GL_UNSIGNED_BYTE, kSide, kSide);
  }
  void release() override { osmesa_.make_current(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0); }
  Symbol symbol(const char *name) const override { return osmesa_.get_proc_address(name); }
  const char *name() const override { return "osmesa"; }

 private:
  static constexpr int kSide = 16;
  const OsMesa &osmesa_;
  OSMesaContext context_;
  std::array<unsigned char, size_t(kSide) * kSide * 4> buffer_{};
};

}  // namespace

std::unique_ptr<Context> create_osmesa(std::string *why_not) {
  const OsMesa &osmesa = shared_osmesa();
  if (!osmesa.ready) {
    *why_not = "OSMesa: libOSMesa.so.8 cannot be loaded: install Debian's libosmesa6";
    return nullptr;
  }
  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_DEPTH_BITS,
                            0,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            3,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            3,
                            0};
  const OSMesaContext context = [&] {
    const std::lock_guard lock(making());
    return osmesa.create_context(attributes, nullptr);
  }();
  if (!context) {
    *why_not = "OSMesa: no OpenGL 3.3 core context: install the libosmesa6 of Debian 12 or later";
    return nullptr;
  }
  return std::make_unique<OsMesaContext>(osmesa, context);
}

}  // namespace render
#else
namespace render {
std::unique_ptr<Context> create_osmesa(std::string *why_not) {
  *why_not = "OSMesa: left out when this program was built: install Debian's libosmesa6-dev and build again";
  return nullptr;
}
}  // namespace render
#endif
