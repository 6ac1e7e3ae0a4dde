// A look at a file before the dynamic linker maps it: a truncated library would end the process by SIGBUS,
// and one without our entry would run its constructors for nothing.
#pragma once
#include <string>

namespace dfm {

// Throws DFM_E_IO or DFM_E_UNSUPPORTED with the reason unless the file is a whole shared object of
// this machine that defines dfm_plugin_entry (that one is taken on trust where the file carries no
// section headers).
void check_elf_plugin(const std::string &path);

}  // namespace dfm
