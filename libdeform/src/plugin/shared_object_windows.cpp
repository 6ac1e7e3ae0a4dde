#ifndef DEFORM_PLUGINS_STATIC

#include <windows.h>

#include <system_error>

#include "core/error.h"
#include "core/path.h"
#include "plugin/shared_object.h"

namespace dfm {
namespace {

constexpr char kEntry[] = "dfm_plugin_entry";

// A library that is mapped to be looked into runs no code. What cannot be loaded opens no window.
HMODULE map(const std::string &file, const std::string &name, DWORD how) {
  DWORD before = 0;
  SetThreadErrorMode(SEM_FAILCRITICALERRORS | SEM_NOOPENFILEERRORBOX, &before);
  const HMODULE image = LoadLibraryExW(path_of(file).make_preferred().c_str(), nullptr, how);
  const DWORD error = GetLastError();
  SetThreadErrorMode(before, nullptr);
  if (!image)  // not every error has a text
    fail(DFM_E_UNSUPPORTED, "%s cannot be loaded: %s (error %lu)", name.c_str(),
         std::system_category().message(int(error)).c_str(), error);
  return image;
}

}  // namespace

SharedObject::SharedObject(const std::string &file, const std::string &name) {
  const HMODULE seen = map(file, name, DONT_RESOLVE_DLL_REFERENCES);
  const bool has_entry = GetProcAddress(seen, kEntry) != nullptr;
  FreeLibrary(seen);
  if (!has_entry) fail(DFM_E_UNSUPPORTED, "%s is not a plugin: it has no symbol %s", name.c_str(), kEntry);
  const HMODULE image = map(file, name, LOAD_LIBRARY_SEARCH_DLL_LOAD_DIR | LOAD_LIBRARY_SEARCH_DEFAULT_DIRS);
  image_ = image;
  entry_ = reinterpret_cast<dfm_plugin_fn>(reinterpret_cast<void *>(GetProcAddress(image, kEntry)));
}

void SharedObject::close(void *image) noexcept {
  if (image) FreeLibrary(static_cast<HMODULE>(image));
}

std::string file_of_library() {
  HMODULE self = nullptr;
  wchar_t name[32768];
  GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
                     reinterpret_cast<LPCWSTR>(&file_of_library), &self);
  return name_of(std::wstring(name, GetModuleFileNameW(self, name, DWORD(std::size(name)))));
}

}  // namespace dfm

#endif
