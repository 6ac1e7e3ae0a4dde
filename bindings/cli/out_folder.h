// The folder of results where --out is not given.
#pragma once
#include <filesystem>
#include <string>

#include "system.h"

namespace cli {

// out/SCENE, by the name of the file. A file that is called scene.json, as `deform mesh from-labels` writes
// one into each of its folders, goes by the name of its folder, else the results of all would be in one:
// out/FOLDER_run. purpose: "run" (not added to the name of another file), "cost", "view".
inline std::string out_folder(const std::string &scene, const std::string &purpose) {
  namespace fs = std::filesystem;
  const fs::path file = path_of(scene);
  std::error_code none;
  const std::string stem = name_of(file.stem());
  const std::string folder = name_of(fs::absolute(file, none).lexically_normal().parent_path().filename());
  if (stem == "scene" && !folder.empty()) return "out/" + folder + "_" + purpose;
  return "out/" + stem + (purpose == "run" ? "" : "_" + purpose);
}

}  // namespace cli
