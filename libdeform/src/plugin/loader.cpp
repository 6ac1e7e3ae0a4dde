#include "plugin/loader.h"

#include <algorithm>
#include <cerrno>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <sstream>

#include "core/error.h"
#include "core/path.h"
#include "core/system.h"
#include "deform/base.h"
#include "plugin/boundary.h"
#include "plugin/registry.h"
#include "plugin/shared_object.h"

// Plugins linked into the library (option DEFORM_PLUGINS_STATIC): X(name) X(name) ..., written by the build.
#ifdef DEFORM_STATIC_PLUGIN_LIST
#define X(name) extern "C" const dfm_plugin *dfm_plugin_entry_##name(const dfm_host *, uint32_t, uint32_t);
DEFORM_STATIC_PLUGIN_LIST
#undef X
#else
#define DEFORM_STATIC_PLUGIN_LIST
#endif

namespace dfm {
namespace {

struct StaticPlugin {
  const char *name;
  dfm_plugin_fn entry;
};
#define X(name) {#name, dfm_plugin_entry_##name},
const std::vector<StaticPlugin> &static_plugins() {
  static const std::vector<StaticPlugin> list{DEFORM_STATIC_PLUGIN_LIST};
  return list;
}
#undef X

thread_local std::string *entry_log = nullptr;

// Only one plugin is loaded or unloaded at a time in the whole process: two contexts may load the same file,
// whose entry may fill its static data, and the locale that a Visit restores is global. Recursive, because an
// entry may create a context.
std::recursive_mutex door;

std::string real_path(const std::string &path) {
  // dlopen searches the system's libraries for a name without a slash
  std::error_code error;
  const std::filesystem::path resolved = std::filesystem::canonical(path_of(path), error);
  if (error) fail(DFM_E_IO, "cannot open plugin \"%s\": %s", path.c_str(), error.message().c_str());
  return name_of(resolved);
}

bool is_directory(const std::string &path) {
  std::error_code error;
  return std::filesystem::is_directory(path_of(path), error);
}

bool is_link(const std::string &path) {
  std::error_code error;
  return std::filesystem::is_symlink(path_of(path), error);
}

std::vector<std::string> entries(const std::string &directory) {
  std::vector<std::string> names;
  if (!os::list_folder(directory, names))
    fail(errno == ENOMEM ? DFM_E_NOMEM : DFM_E_IO, "cannot read plugin directory \"%s\": %s",
         directory.c_str(), std::strerror(errno));
  std::sort(names.begin(), names.end());  // the same order on every file system
  return names;
}

// Lives while initializers and the entry function of a plugin run. Restores the floating-point environment
// and the decimal point afterwards, since a changed one would make the host misread or miscompute numbers.
class Visit {
 public:
  Visit(const dfm_host &host, const std::string &file)
      : host_(host),
        file_(file),
        locale_(std::setlocale(LC_NUMERIC, nullptr)),
        boundary_(file.c_str(), "load") {}
  ~Visit() { restore_environment(); }
  Visit(const Visit &) = delete;
  // Says so, too, where something was changed.
  void end() {
    char sentence[1024];
    const char *changed = restore_environment();
    if (!changed) return;
    std::snprintf(sentence, sizeof sentence,
                  "%s: loading it changed %s, which was restored; a plugin must leave it unchanged",
                  file_.c_str(), changed);
    host_.log(host_.ctx, DFM_LOG_WARNING, 0, sentence);
  }

 private:
  const char *restore_environment() noexcept {
    const char *changed = boundary_.restore();
    if (locale_ != std::setlocale(LC_NUMERIC, nullptr)) {
      std::setlocale(LC_NUMERIC, locale_.c_str());
      changed = "the locale of numbers";
    }
    return changed;
  }
  const dfm_host &host_;
  const std::string &file_;
  const std::string locale_;
  Boundary boundary_;
};

}  // namespace

void Loader::note_log(const char *text) noexcept {
  if (!entry_log || !text) return;
  try {
    if (!entry_log->empty()) *entry_log += "; ";
    entry_log->append(text, strnlen(text, 512));
  } catch (...) {}
}

// Does not allocate, since memory may have run out.
void Loader::shut_down(const Module &module) noexcept {
  const Boundary boundary(module.file.c_str(), "shutdown");
  try {
    if (module.shutdown) module.shutdown();
  } catch (...) {
    char text[512];
    std::snprintf(text, sizeof text, "%s: its shutdown threw an exception", module.file.c_str());
    host_.log(host_.ctx, DFM_LOG_WARNING, 0, text);
  }
}

Loader::~Loader() {
  while (!modules_.empty()) {
    const Module module = std::move(modules_.back());
    modules_.pop_back();
    const std::lock_guard one_at_a_time(door);
    shut_down(module);
    SharedObject::close(module.image);
  }
}

// Calls the entry and copies the result; nothing except the two ABI numbers is read before these match.
void Loader::enter(dfm_plugin_fn entry, const std::string &file, dfm_plugin &plugin) {
  std::string said;
  const dfm_plugin *given = nullptr;
  bool threw = false;
  entry_log = &said;
  try {
    given = entry(&host_, DFM_ABI, DFM_ABI_MIN);
  } catch (...) {
    threw = true;
  }
  entry_log = nullptr;
  if (threw)
    fail(DFM_E_UNSUPPORTED, "%s: its entry threw an exception%s%s", file.c_str(),
         said.empty() ? "" : " after it said: ", said.c_str());
  if (!given)
    fail(DFM_E_UNSUPPORTED,
         "%s: the plugin refuses this library, which has plugin ABI %u%s%s; if it was built for a draft or "
         "another ABI, rebuild it against this library's deform/plugin.h",
         file.c_str(), DFM_ABI, said.empty() ? ", and gave no reason" : ": ", said.c_str());
  if (given->abi == 0)
    fail(DFM_E_UNSUPPORTED,
         "%s: built for a draft of the plugin ABI (ABI 0 draft %u), which no library has accepted since ABI "
         "1; rebuild it against this library's deform/plugin.h",
         file.c_str(), given->abi_draft);
  if (given->abi < DFM_ABI_MIN || given->abi > DFM_ABI || given->abi_draft != DFM_ABI_DRAFT)
    fail(DFM_E_UNSUPPORTED,
         "%s: built for plugin ABI %u draft %u, this library has ABI %u draft %u; rebuild it against this "
         "library's deform/plugin.h, or use a library with that ABI",
         file.c_str(), given->abi, given->abi_draft, DFM_ABI, DFM_ABI_DRAFT);
  constexpr uint32_t head = offsetof(dfm_plugin, types) + sizeof(void *);
  if (given->size < head || given->size > 65536)
    fail(DFM_E_UNSUPPORTED, "%s: dfm_plugin.size is %u, at least %u expected", file.c_str(), given->size,
         head);
  plugin = dfm_plugin{};
  std::memcpy(&plugin, given, std::min<size_t>(given->size, sizeof plugin));
}

const Loader::Module *Loader::loaded_from(uint64_t device, uint64_t inode) const {
  for (const Module &module : modules_)
    if (module.image && module.device == device && module.inode == inode) return &module;
  return nullptr;
}

bool Loader::load(const std::string &path) {
  const std::string file = real_path(path);
  os::FileStatus status;
  if (!os::status_of(file, status))
    fail(DFM_E_IO, "cannot read plugin \"%s\": %s", path.c_str(), std::strerror(errno));
  if (status.kind) fail(DFM_E_UNSUPPORTED, "%s is not a file", path.c_str());
  if (loaded_from(status.device, status.number)) return false;

  const std::lock_guard one_at_a_time(door);
  Visit visit(host_, path);
  SharedObject library(file, path);
  const dfm_plugin_fn entry = library.entry();
  dfm_plugin plugin;
  enter(entry, path, plugin);
  visit.end();
  keep({nullptr, status.device, status.number, path, entry, plugin.shutdown}, plugin);
  modules_.back().image = library.release();
  return true;
}

// Adds it to the registry and to the list of modules, or to neither.
void Loader::keep(Module &&module, const dfm_plugin &plugin) {
  try {
    modules_.reserve(modules_.size() + 1);
    registry_.add(plugin, module.file);
  } catch (...) {
    shut_down(module);
    throw;
  }
  modules_.push_back(std::move(module));
}

uint32_t Loader::scan(const std::string &directory) {
  const std::vector<std::string> names = entries(directory);
  uint32_t loaded = 0;
  for (const std::string &name : names) {
    const std::string path = directory + (directory.back() == '/' ? "" : "/") + name;
    if (is_directory(path)) {
      registry_.pass_over(path, "a directory: plugins lie directly in the plugin directory");
    } else if (!name.ends_with(os::kPluginEnding)) {
      registry_.pass_over(path, std::string("its name does not end in ") + os::kPluginEnding);
    } else {
      try {
        if (load(path)) ++loaded;
        else if (is_link(path)) registry_.pass_over(path, "a link to a plugin that is loaded already");
      } catch (const Error &e) {
        registry_.pass_over(path, e.sentence);
      }
    }
  }
  return loaded;
}

void Loader::add_static(dfm_plugin_fn entry, const std::string &name) {
  for (const Module &module : modules_)
    if (module.entry == entry) return;
  const std::string file = "static:" + name;
  dfm_plugin plugin;
  const std::lock_guard one_at_a_time(door);
  Visit visit(host_, file);
  enter(entry, file, plugin);
  visit.end();
  keep({nullptr, 0, 0, file, entry, plugin.shutdown}, plugin);
}

std::vector<const dfm_type *> Loader::types_of(const std::string &path) const {
  os::FileStatus status;
  std::vector<const dfm_type *> out;
  if (!os::status_of(path, status)) return out;
  const Module *const module = loaded_from(status.device, status.number);
  for (const dfm_type *type : registry_.list())
    if (module && registry_.file_of(*type) == module->file) out.push_back(type);
  return out;
}

void Loader::scan_if_there(const std::string &directory, bool must_exist) {
  if (directory.empty()) return;
  if (!is_directory(directory)) {
    if (must_exist)
      registry_.pass_over(directory, "named in DEFORM_PLUGIN_PATH, but there is no such directory");
    return;
  }
  try {
    scan(directory);
  } catch (const Error &e) {
    registry_.pass_over(directory, e.sentence);
  }
}

void Loader::add_bundled() {
  for (const StaticPlugin &plugin : static_plugins()) {
    try {
      add_static(plugin.entry, plugin.name);
    } catch (const Error &e) {
      registry_.pass_over(std::string("static:") + plugin.name, e.sentence);
    }
  }
}

bool is_bundled(const std::string &file) {
  return std::ranges::any_of(static_plugins(), [&](const StaticPlugin &plugin) {
    return file == "static:" + std::string(plugin.name);
  });
}

void Loader::discover() {
  const char *const variable = "DEFORM_PLUGIN_PATH";
  const std::optional<std::string> path = os::trusted_environment(variable);
  if (!path && os::environment(variable))
    registry_.pass_over(variable, "ignored: the process runs with elevated privilege");
  std::istringstream folders(path.value_or(""));
  for (std::string folder; std::getline(folders, folder, os::kBetweenPaths);) scan_if_there(folder, true);
  scan_if_there(default_plugin_directory(), false);
}

}  // namespace dfm
