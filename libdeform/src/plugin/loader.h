// Plugin files into the registry: one symbol, one ABI, a reason for everything passed over.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "deform/plugin.h"

namespace dfm {

class Registry;

class Loader {
 public:
  Loader(Registry &registry, const dfm_host &host) : registry_(registry), host_(host) {}
  ~Loader();  // shuts the plugins down and closes them, last loaded first
  Loader(const Loader &) = delete;
  Loader &operator=(const Loader &) = delete;

  // Returns true where the file was loaded now, false where it was there already (the same file under another
  // name counts as there). Throws DFM_E_IO, DFM_E_UNSUPPORTED or DFM_E_STATE with the reason.
  bool load(const std::string &path);
  // Every plugin of a directory, by name; what is passed over goes to the registry with its reason. Throws
  // DFM_E_IO: no directory.
  uint32_t scan(const std::string &directory);
  void add_static(dfm_plugin_fn entry, const std::string &name);
  void add_bundled();  // plugins linked into this library (option DEFORM_PLUGINS_STATIC)
  // DEFORM_PLUGIN_PATH (not under elevated privilege), then the directory beside this library, else the
  // installed one.
  void discover();
  // Plugins of one file, by type id order; empty where the file is not loaded.
  std::vector<const dfm_type *> types_of(const std::string &path) const;

  // What a plugin logs from its entry becomes part of the reason.
  static void note_log(const char *text) noexcept;

 private:
  struct Module {
    void *image;
    uint64_t device, inode;
    std::string file;
    dfm_plugin_fn entry;
    void (*shutdown)(void);
  };
  void keep(Module &&module, const dfm_plugin &plugin);
  void enter(dfm_plugin_fn entry, const std::string &file, dfm_plugin &plugin);
  void scan_if_there(const std::string &directory, bool asked_for);
  Registry &registry_;
  const dfm_host &host_;
  std::vector<Module> modules_;
};

}  // namespace dfm
