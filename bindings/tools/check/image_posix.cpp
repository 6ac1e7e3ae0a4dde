#include "check/image.h"

#include <dirent.h>
#include <dlfcn.h>
#include <elf.h>
#include <link.h>
#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "check/check.h"
#include "file.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define DEFORM_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define DEFORM_SANITIZED 1
#endif
#endif
#ifndef DEFORM_SANITIZED
#define DEFORM_SANITIZED 0
#endif

#if DEFORM_SANITIZED
// not every compiler brings the header that declares it
extern "C" size_t __sanitizer_get_current_allocated_bytes();
#endif

namespace cli::check {

// ---- loaded -----------------------------------------------------------------------------------------------

namespace {

// The dynamic linker searches the system's libraries for a name without a slash.
std::string path_to(const std::string &file) {
  std::error_code error;
  const std::filesystem::path path = std::filesystem::canonical(file, error);
  return error ? file : path.string();
}

}  // namespace

void *load_image(const std::string &file, std::string &why) {
  void *image = dlopen(path_to(file).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!image) why = dlerror();
  return image;
}

void *symbol_of(void *image, const char *name) { return dlsym(image, name); }

void unload_image(void *image) { dlclose(image); }

bool image_stays(const std::string &file) {
  void *still = dlopen(path_to(file).c_str(), RTLD_NOW | RTLD_NOLOAD);
  if (still) dlclose(still);
  return still != nullptr;
}

// ---- its file ---------------------------------------------------------------------------------------------

namespace {

template <class T>
std::vector<T> part(const std::string &bytes, uint64_t offset, uint64_t count) {
  std::vector<T> out;
  if (offset > bytes.size() || count > (bytes.size() - offset) / sizeof(T)) return out;
  out.resize(count);
  if (count) std::memcpy(out.data(), bytes.data() + offset, count * sizeof(T));
  return out;
}

std::string bytes_of(const std::string &file) {
  return read_file(file, uint64_t(1) << 30, "a plugin (a shared library)");
}

struct Symbol {
  std::string name;
  ElfW(Sym) entry;
};
// Symbols of that type of section (SHT_DYNSYM, SHT_SYMTAB); false: the file has no section headers.
bool read_symbols(const std::string &bytes, unsigned type, std::vector<Symbol> &out) {
  const auto header = part<ElfW(Ehdr)>(bytes, 0, 1);
  if (header.empty()) return false;
  const auto sections = part<ElfW(Shdr)>(bytes, header[0].e_shoff,
                                         header[0].e_shentsize == sizeof(ElfW(Shdr)) ? header[0].e_shnum : 0);
  for (const auto &section : sections) {
    if (section.sh_type != type || section.sh_link >= sections.size()) continue;
    const auto &strings = sections[section.sh_link];
    const auto names = part<char>(bytes, strings.sh_offset, strings.sh_size);
    for (const auto &s : part<ElfW(Sym)>(bytes, section.sh_offset, section.sh_size / sizeof(ElfW(Sym))))
      out.push_back(
          {s.st_name < names.size()
               ? std::string(&names[s.st_name], strnlen(&names[s.st_name], names.size() - s.st_name))
               : "",
           s});
  }
  return !sections.empty();
}

}  // namespace

// Defined symbols of the dynamic table that others may bind to.
std::vector<std::string> exported(const std::string &file) {
  const std::string bytes = bytes_of(file);
  if (bytes.size() < sizeof(ElfW(Ehdr)) || std::memcmp(bytes.data(), ELFMAG, SELFMAG) != 0)
    broken("it is not a shared library (ELF); build it with deform_add_plugin");
  std::vector<Symbol> symbols;
  if (!read_symbols(bytes, SHT_DYNSYM, symbols))
    skip("the file has no section headers; run the check before you strip the file");
  std::vector<std::string> out;
  for (const Symbol &s : symbols) {
    const int visibility = s.entry.st_other & 3, binding = s.entry.st_info >> 4;
    if (s.entry.st_shndx == SHN_UNDEF || binding == STB_LOCAL || visibility == STV_HIDDEN ||
        visibility == STV_INTERNAL)
      continue;
    if (!s.name.empty()) out.push_back(s.name);
  }
  std::ranges::sort(out);
  return out;
}

std::string variable_at(const std::string &file, uint64_t address) {
  std::vector<Symbol> symbols;
  read_symbols(bytes_of(file), SHT_SYMTAB, symbols);
  for (const Symbol &s : symbols) {
    const bool inside =
        address >= s.entry.st_value && address - s.entry.st_value < std::max<uint64_t>(s.entry.st_size, 1);
    if (inside && (s.entry.st_info & 15) == STT_OBJECT) return s.name.substr(0, s.name.find('.'));
  }
  return "";
}

// ---- in use -----------------------------------------------------------------------------------------------

namespace {

#if DEFORM_SANITIZED
long heap_in_use() { return static_cast<long>(__sanitizer_get_current_allocated_bytes()); }
#else
long heap_in_use() { return static_cast<long>(mallinfo2().uordblks + mallinfo2().hblkhd); }
#endif

// From the list, since the number in statm has an emulator's own pages, too.
long pages_mapped() {
  unsigned long bytes = 0, from = 0, to = 0;
  if (DEFORM_SANITIZED) return 0;
  if (FILE *f = std::fopen("/proc/self/maps", "r")) {
    while (std::fscanf(f, "%lx-%lx%*[^\n]", &from, &to) == 2) bytes += to - from;
    std::fclose(f);
  }
  return static_cast<long>(bytes / 4096);
}

long files_open() {
  long n = 0;
  if (DIR *d = opendir("/proc/self/fd")) {
    while (readdir(d)) ++n;
    closedir(d);
  }
  return n;
}

}  // namespace

bool is_sanitized() { return DEFORM_SANITIZED; }

Use in_use() { return {heap_in_use(), pages_mapped(), files_open()}; }

}  // namespace cli::check
