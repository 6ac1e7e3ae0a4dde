#include "check/image.h"

#include <windows.h>

#include <malloc.h>
#include <psapi.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "check/check.h"
#include "file.h"
#include "system.h"

namespace cli::check {

// ---- loaded -----------------------------------------------------------------------------------------------

void *load_image(const std::string &file, std::string &why) {
  const std::filesystem::path path = std::filesystem::absolute(path_of(file)).make_preferred();
  const HMODULE image = LoadLibraryExW(path.c_str(), nullptr,
                                       LOAD_LIBRARY_SEARCH_DLL_LOAD_DIR | LOAD_LIBRARY_SEARCH_DEFAULT_DIRS);
  if (!image) why = std::system_category().message(int(GetLastError()));
  return image;
}

void *symbol_of(void *image, const char *name) {
  return reinterpret_cast<void *>(GetProcAddress(static_cast<HMODULE>(image), name));
}

void unload_image(void *image) { FreeLibrary(static_cast<HMODULE>(image)); }

bool image_stays(const std::string &file) {
  return GetModuleHandleW(std::filesystem::absolute(path_of(file)).make_preferred().c_str()) != nullptr;
}

// ---- its file ---------------------------------------------------------------------------------------------

namespace {

[[noreturn]] void not_pe() {
  broken("it is not a shared library (PE of 64 bits); build it with deform_add_plugin");
}

template <class T>
T part(const std::string &bytes, uint64_t offset) {
  T out{};
  if (offset > bytes.size() || bytes.size() - offset < sizeof out) not_pe();
  std::memcpy(&out, bytes.data() + offset, sizeof out);
  return out;
}

// A file by the addresses that its parts have in memory, from its begin on.
class Mapped {
 public:
  explicit Mapped(const std::string &bytes) : bytes_(bytes) {
    const uint64_t at = uint64_t(part<IMAGE_DOS_HEADER>(bytes, 0).e_lfanew);
    header_ = part<IMAGE_NT_HEADERS64>(bytes, at);
    if (header_.Signature != IMAGE_NT_SIGNATURE ||
        header_.OptionalHeader.Magic != IMAGE_NT_OPTIONAL_HDR64_MAGIC)
      not_pe();
    const uint64_t sections =
        at + offsetof(IMAGE_NT_HEADERS64, OptionalHeader) + header_.FileHeader.SizeOfOptionalHeader;
    for (unsigned k = 0; k < header_.FileHeader.NumberOfSections; ++k)
      sections_.push_back(part<IMAGE_SECTION_HEADER>(bytes, sections + k * sizeof(IMAGE_SECTION_HEADER)));
  }
  const IMAGE_DATA_DIRECTORY &directory(unsigned number) const {
    return header_.OptionalHeader.DataDirectory[number];
  }
  uint64_t offset(uint32_t address) const {
    for (const IMAGE_SECTION_HEADER &s : sections_)
      if (address - s.VirtualAddress < s.SizeOfRawData)
        return address - s.VirtualAddress + s.PointerToRawData;
    return bytes_.size();
  }

 private:
  const std::string &bytes_;
  IMAGE_NT_HEADERS64 header_{};
  std::vector<IMAGE_SECTION_HEADER> sections_;
};

}  // namespace

std::vector<std::string> exported(const std::string &file) {
  const std::string bytes = read_file(file, uint64_t(1) << 30, "a plugin (a shared library)");
  const Mapped mapped(bytes);
  std::vector<std::string> out;
  const IMAGE_DATA_DIRECTORY &where = mapped.directory(IMAGE_DIRECTORY_ENTRY_EXPORT);
  if (!where.Size) return out;
  const auto table = part<IMAGE_EXPORT_DIRECTORY>(bytes, mapped.offset(where.VirtualAddress));
  for (uint32_t k = 0; k < table.NumberOfNames; ++k) {
    const uint64_t name = mapped.offset(part<uint32_t>(bytes, mapped.offset(table.AddressOfNames + 4 * k)));
    if (name >= bytes.size()) not_pe();
    out.emplace_back(&bytes[name], strnlen(&bytes[name], bytes.size() - name));
  }
  std::ranges::sort(out);
  return out;
}

std::string variable_at(const std::string &, uint64_t) { return ""; }

// ---- in use -----------------------------------------------------------------------------------------------

bool is_sanitized() { return false; }

Use in_use() {
  Use use{};
  _HEAPINFO piece{};
  while (_heapwalk(&piece) == _HEAPOK)
    if (piece._useflag == _USEDENTRY) use.heap += long(piece._size);
  PROCESS_MEMORY_COUNTERS memory{};
  GetProcessMemoryInfo(GetCurrentProcess(), &memory, sizeof memory);
  use.pages = long(memory.PagefileUsage / 4096);
  DWORD handles = 0;
  GetProcessHandleCount(GetCurrentProcess(), &handles);
  use.files = long(handles);
  return use;
}

}  // namespace cli::check
