// Opens plugin files through the dynamic linker of the system. Built with DEFORM_PLUGINS_STATIC, this file
// does not use a dynamic linker and refuses every file with a message, so that programs can be linked on
// systems without one.
#pragma once
#include <string>
#include <utility>

#include "deform/plugin.h"

namespace dfm {

class SharedObject {
 public:
  // Checks the file before any code in it runs. Throws DFM_E_UNSUPPORTED or DFM_E_IO; `name` is its name in
  // messages.
  SharedObject(const std::string &file, const std::string &name);
  ~SharedObject() { close(image_); }
  SharedObject(const SharedObject &) = delete;
  SharedObject &operator=(const SharedObject &) = delete;
  dfm_plugin_fn entry() const { return entry_; }
  void *release() noexcept { return std::exchange(image_, nullptr); }
  static void close(void *image) noexcept;

 private:
  void *image_ = nullptr;
  dfm_plugin_fn entry_ = nullptr;
};

// Directory of the plugins of this library (build tree or relocated installation), else the configured one;
// empty if the plugins are linked into the library.
std::string default_plugin_directory();

// The value of an environment variable; null where it is unset, or where the process could open files in the
// name of another user than the one who has set it.
const char *trusted_environment(const char *name);

}  // namespace dfm
