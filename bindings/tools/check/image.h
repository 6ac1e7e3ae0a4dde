// A plugin's file as the system loads it, what is written in it, and what this process has in use:
// image_posix.cpp, image_windows.cpp.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace cli::check {

void *load_image(const std::string &file, std::string &why);  // null: why
void *symbol_of(void *image, const char *name);
void unload_image(void *image);
bool image_stays(const std::string &file);  // in memory, although it was unloaded

// What others may bind to, sorted; throws Broken or Skipped where the file does not tell.
std::vector<std::string> exported(const std::string &file);
// The variable at an offset of the loaded file; empty: unknown.
std::string variable_at(const std::string &file, uint64_t offset);

bool is_sanitized();                      // this program
struct Use { long heap, pages, files; };  // bytes, pages that are mapped, files that are open
Use in_use();

}  // namespace cli::check
