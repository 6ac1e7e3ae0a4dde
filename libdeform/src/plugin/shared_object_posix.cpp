#ifndef DEFORM_PLUGINS_STATIC

#include <dlfcn.h>

#include <cstring>

#include "core/error.h"
#include "core/path.h"
#include "plugin/shared_object.h"

namespace dfm {

SharedObject::SharedObject(const std::string &file, const std::string &name) {
#if __has_include(<link.h>)
  check_plugin_file(file);
#endif
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

std::string file_of_library() {
  namespace fs = std::filesystem;
  Dl_info info{};
  std::error_code error;
  if (dladdr(reinterpret_cast<void *>(&file_of_library), &info) && info.dli_fname &&
      std::strchr(info.dli_fname, '/')) {
    // For the main program dladdr returns argv[0], which may be another file.
    const fs::path self = fs::canonical(info.dli_fname, error);
    if (!error && self.extension() != "") return name_of(self);
  }
  return name_of(fs::canonical("/proc/self/exe", error));
}

}  // namespace dfm

#endif
