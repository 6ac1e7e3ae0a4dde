#include "costs_file.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "messages.h"
#include "system.h"

namespace cli {
namespace fs = std::filesystem;

std::string costs_file() {
  const std::string folder = os::settings_folder();
  return folder.empty() ? "" : folder + "/deform/costs.json";
}

void offer_costs() {
  const std::string path = costs_file();
  std::error_code ignored;
  if (!path.empty() && fs::is_regular_file(path_of(path), ignored)) os::set_if_unset("DEFORM_COSTS", path);
}

std::string machine_name() {
  std::ifstream info("/proc/cpuinfo");
  std::string line, name = "unknown processor";
  while (std::getline(info, line))
    if (line.rfind("model name", 0) == 0) {
      name = line.substr(line.find(':') + 2);
      break;
    }
  return name + ", " +
#ifdef __clang__
         "clang " __clang_version__
#else
         "gcc " __VERSION__
#endif
         + ", deform " + dfm_version(nullptr, nullptr, nullptr);
}

}  // namespace cli
