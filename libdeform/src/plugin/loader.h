// Loads plugin files into the registry: one symbol, one ABI, and a reason for every file that is skipped.
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

  // Returns true if the file was loaded now, false if it was loaded before (also under another name). Throws
  // DFM_E_IO, DFM_E_UNSUPPORTED or DFM_E_STATE with the reason.
  bool load(const std::string &path);
  // Loads every plugin of a directory, by name; skipped files go to the registry with the reason. Throws
  // DFM_E_IO if it is no directory.
  uint32_t scan(const std::string &directory);
  void add_static(dfm_plugin_fn entry, const std::string &name);
  void add_bundled();  // plugins linked into this library (option DEFORM_PLUGINS_STATIC)
  // Loads from DEFORM_PLUGIN_PATH (not with elevated privileges), then from the directory next to this
  // library, else from the installed one.
  void discover();
  // Plugins of one file, ordered by type id; empty if the file is not loaded.
  std::vector<const dfm_type *> types_of(const std::string &path) const;

  // Messages that a plugin logs in its entry become part of the reason.
  static void note_log(const char *text) noexcept;

 private:
  struct Module {
    void *image;
    uint64_t device, inode;
    std::string file;
    dfm_plugin_fn entry;
    void (*shutdown)(void);
  };
  const Module *loaded_from(uint64_t device, uint64_t inode) const;  // null: no module
  void keep(Module &&module, const dfm_plugin &plugin);
  void shut_down(const Module &module) noexcept;
  void enter(dfm_plugin_fn entry, const std::string &file, dfm_plugin &plugin);
  void scan_if_there(const std::string &directory, bool must_exist);
  Registry &registry_;
  const dfm_host &host_;
  std::vector<Module> modules_;
};

}  // namespace dfm
