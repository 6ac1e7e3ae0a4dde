// Checks a file before the dynamic linker maps it: a truncated library would end the process by SIGBUS, and a
// library without the entry point would run its constructors for nothing.
#pragma once
#include <string>

namespace dfm {

// Throws DFM_E_IO or DFM_E_UNSUPPORTED with the reason unless the file is a complete shared object for this
// machine that defines dfm_plugin_entry (not checked if the file has no section headers).
void check_elf_plugin(const std::string &path);

}  // namespace dfm
