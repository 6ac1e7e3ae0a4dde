#if !defined(DEFORM_PLUGINS_STATIC) && __has_include(<link.h>)  // systems whose programs are ELF

#include <elf.h>
#include <link.h>
#include <unistd.h>

#include <cstring>
#include <vector>

#include "core/error.h"
#include "core/file.h"
#include "plugin/shared_object.h"

namespace dfm {
namespace {

struct File : InputFile {
  explicit File(const std::string &path) : InputFile(path, "a plugin (a shared library)") {}
  bool read(uint64_t offset, void *to, size_t n) const {
    if (n > bytes() || offset > bytes() - n) return false;
    return pread(descriptor(), to, n, static_cast<off_t>(offset)) == static_cast<ssize_t>(n);
  }
  template <class T>
  bool read_all(uint64_t offset, uint64_t count, std::vector<T> &to) const {
    if (count > bytes() / sizeof(T)) return false;
    to.resize(count);
    return count == 0 || read(offset, to.data(), count * sizeof(T));
  }
};

#if __SIZEOF_POINTER__ == 8
constexpr unsigned char kClass = ELFCLASS64;
#else
constexpr unsigned char kClass = ELFCLASS32;
#endif
#if defined(__x86_64__)
constexpr int kMachine = EM_X86_64;
#elif defined(__aarch64__)
constexpr int kMachine = EM_AARCH64;
#else
constexpr int kMachine = -1;  // left to the dynamic linker
#endif

bool defines_entry(const File &file, const ElfW(Ehdr) & header, bool *known) {
  std::vector<ElfW(Shdr)> sections;
  *known = header.e_shnum != 0 && header.e_shentsize == sizeof(ElfW(Shdr)) &&
           file.read_all(header.e_shoff, header.e_shnum, sections);
  if (!*known) return false;
  for (const auto &section : sections) {
    if (section.sh_type != SHT_DYNSYM || section.sh_link >= sections.size()) continue;
    std::vector<ElfW(Sym)> symbols;
    std::vector<char> names;
    const auto &strings = sections[section.sh_link];
    if (!file.read_all(section.sh_offset, section.sh_size / sizeof(ElfW(Sym)), symbols)) continue;
    if (!file.read_all(strings.sh_offset, strings.sh_size, names)) continue;
    names.push_back(0);
    for (const auto &symbol : symbols)
      if (symbol.st_shndx != SHN_UNDEF && symbol.st_name < names.size() &&
          std::strcmp(&names[symbol.st_name], "dfm_plugin_entry") == 0)
        return true;
  }
  return false;
}

}  // namespace

void check_plugin_file(const std::string &path) {
  const char *const name = path.c_str();
  const File file(path);
  ElfW(Ehdr) header;
  if (!file.read(0, &header, sizeof header) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0)
    fail(DFM_E_UNSUPPORTED, "%s is not a plugin: it is not a shared library (ELF)", name);
  if (header.e_ident[EI_CLASS] != kClass || (kMachine >= 0 && header.e_machine != kMachine))
    fail(DFM_E_UNSUPPORTED, "%s is built for another machine (ELF class %d, machine %d)", name,
         header.e_ident[EI_CLASS], header.e_machine);
  if (header.e_type != ET_DYN)
    fail(DFM_E_UNSUPPORTED, "%s is not a shared library; build it with deform_add_plugin", name);
  std::vector<ElfW(Phdr)> segments;
  bool whole =
      header.e_phentsize == sizeof(ElfW(Phdr)) && file.read_all(header.e_phoff, header.e_phnum, segments);
  for (const auto &segment : segments)
    if (segment.p_type == PT_LOAD)
      whole &= segment.p_filesz <= file.bytes() && segment.p_offset <= file.bytes() - segment.p_filesz;
  if (!whole)
    fail(DFM_E_UNSUPPORTED, "%s is cut short: parts that its header names lie beyond its %llu bytes", name,
         static_cast<unsigned long long>(file.bytes()));
  bool known;
  if (!defines_entry(file, header, &known) && known)
    fail(DFM_E_UNSUPPORTED, "%s is not a plugin: it has no symbol dfm_plugin_entry", name);
}

}  // namespace dfm

#endif
