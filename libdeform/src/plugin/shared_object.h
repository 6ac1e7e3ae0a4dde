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
  // Checks the file, of an absolute path, before any code in it runs. Throws DFM_E_UNSUPPORTED or DFM_E_IO;
  // `name` is its name in messages.
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
// "static:NAME" of a plugin that is linked into this library (loader.cpp).
bool is_bundled(const std::string &file);

// The system's part: shared_object_posix.cpp, shared_object_windows.cpp. The file of this library, or of the
// program that it is linked into; empty: unknown.
std::string file_of_library();

// Throws DFM_E_IO or DFM_E_UNSUPPORTED with the reason unless the file is a complete shared object for this
// machine that defines dfm_plugin_entry (not checked if the file has no section headers). It is checked
// before the dynamic linker maps it: a truncated library would end the process by SIGBUS, and a library
// without the entry point would run its constructors for nothing. In elf_file.cpp.
void check_plugin_file(const std::string &path);

}  // namespace dfm
