#include "plugin/shared_object.h"

#include "core/error.h"

#ifdef DEFORM_PLUGINS_STATIC

namespace dfm {

SharedObject::SharedObject(const std::string &, const std::string &name) {
  fail(DFM_E_UNSUPPORTED,
       "%s is not opened: this library was built without loading of files (DEFORM_PLUGINS_STATIC); link the "
       "plugin into the program and call dfm_plugin_register_static",
       name.c_str());
}
void SharedObject::close(void *) noexcept {}
std::string default_plugin_directory() { return {}; }

}  // namespace dfm

#else

#include <dlfcn.h>

#include <cstring>
#include <filesystem>

#include "plugin/elf_file.h"

namespace dfm {

namespace fs = std::filesystem;

SharedObject::SharedObject(const std::string &file, const std::string &name) {
  check_elf_plugin(file);
  image_ = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!image_) fail(DFM_E_UNSUPPORTED, "%s cannot be loaded: %s", name.c_str(), dlerror());
  entry_ = reinterpret_cast<dfm_plugin_fn>(dlsym(image_, "dfm_plugin_entry"));
  if (entry_) return;
  close(release());
  fail(DFM_E_UNSUPPORTED, "%s is not a plugin: it has no symbol dfm_plugin_entry", name.c_str());
}

void SharedObject::close(void *image) noexcept {
  if (image) dlclose(image);
}

std::string default_plugin_directory() {
  Dl_info info{};
  std::string self;
  if (dladdr(reinterpret_cast<void *>(&default_plugin_directory), &info) && info.dli_fname &&
      std::strchr(info.dli_fname, '/'))
    self = info.dli_fname;
  std::error_code error;
  fs::path binary = self.empty() ? fs::path() : fs::canonical(self, error);
  // For the main program dladdr returns argv[0], which may be another file.
  if (self.empty() || error || binary.extension() == "") binary = fs::canonical("/proc/self/exe", error);
  for (const char *relative : {"deform", "../lib/deform"}) {
    const fs::path candidate = binary.parent_path() / relative / DEFORM_ABI_DIR;
    if (fs::is_directory(candidate, error)) return fs::canonical(candidate, error).string();
  }
  return DEFORM_INSTALL_PLUGIN_DIR;
}

}  // namespace dfm

#endif
