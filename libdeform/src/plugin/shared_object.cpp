#include "plugin/shared_object.h"

#include "core/error.h"
#include "core/path.h"

namespace dfm {

#ifdef DEFORM_PLUGINS_STATIC

SharedObject::SharedObject(const std::string &, const std::string &name) {
  fail(DFM_E_UNSUPPORTED,
       "%s is not opened: this library was built without loading of files (DEFORM_PLUGINS_STATIC); link the "
       "plugin into the program and call dfm_plugin_register_static",
       name.c_str());
}
void SharedObject::close(void *) noexcept {}
std::string default_plugin_directory() { return {}; }

#else

std::string default_plugin_directory() {
  namespace fs = std::filesystem;
  const fs::path folder = path_of(file_of_library()).parent_path();
  std::error_code error;
  for (const char *relative : {"deform", "../lib/deform"}) {
    const fs::path candidate = folder / relative / DEFORM_ABI_DIR;
    if (fs::is_directory(candidate, error)) return name_of(fs::canonical(candidate, error));
  }
  return DEFORM_INSTALL_PLUGIN_DIR;
}

#endif

}  // namespace dfm
