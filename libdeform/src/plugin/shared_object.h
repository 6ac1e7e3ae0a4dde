// Plugin files as the system's dynamic linker opens them. Built with DEFORM_PLUGINS_STATIC nothing here
// knows a dynamic linker: every file is refused with a sentence, so that a program may be linked where
// there is none.
#pragma once
#include <string>
#include <utility>

#include "deform/plugin.h"

namespace dfm {

class SharedObject {
 public:
  // Looks at the file before anything in it runs. Throws DFM_E_UNSUPPORTED or DFM_E_IO; `name` is what
  // sentences call it.
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

// Directory of the plugins that belong to this library (build tree or relocated installation), else the
// configured one; empty where they are linked into it.
std::string default_plugin_directory();

}  // namespace dfm
