#include "run_folder.h"

#include <dirent.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <regex>
#include <vector>

#include "file.h"
#include "messages.h"
#include "system.h"

namespace fs = std::filesystem;

namespace cli {
namespace {

// By readdir: the iterators of the standard library allocate inside functions that must not throw, so memory
// that runs out there ends the process.
void find_matching(const std::string &folder, const char *pattern, std::vector<fs::path> &found) {
  const std::regex names(pattern);
  const std::unique_ptr<DIR, int (*)(DIR *)> open(opendir(folder.c_str()), &closedir);
  for (const dirent *entry; open && (entry = readdir(open.get()));)
    if (std::regex_match(entry->d_name, names)) found.push_back(path_of(folder) / path_of(entry->d_name));
}

// A run that was killed has its table of bodies, perhaps without a row.
bool is_of_a_run(const std::string &folder) {
  std::error_code absent;
  return holds(folder + "/summary.json", "\"deform-summary\"") ||
         holds(folder + "/recording/run.json", "\"deform-recording\"") ||
         holds(folder + "/bodies.csv", "t,body,com_x") ||
         (fs::file_size(path_of(folder + "/bodies.csv"), absent) == 0 && !absent);
}

// What a link leads to may hold files of the same names that are no run's. A folder is not replaced as a file
// is: the link may be meant.
void refuse_linked_folders(const std::string &folder) {
  for (const char *name : {"/states", "/nodes", "/frames", "/recording"}) {
    std::error_code error;
    if (fs::is_symlink(path_of(folder + name), error))
      throw Failure(kBadInput,
                    folder + name +
                        ": a symbolic link, and a run deletes and writes files in this folder; remove the "
                        "link, or give another folder with --out (which may itself be a link)");
  }
}

// Files of an earlier run would look like results of this one. The summary is removed first: without it the
// rest is not taken for a complete run, and what tells that there was one last. Files that a killed process
// was writing are removed too. Pictures alone, of `deform replay --states`, have their numbers.
void remove_earlier(const std::string &folder) {
  std::vector<fs::path> found;
  const auto find = [&](const std::string &in, const char *pattern) { find_matching(in, pattern, found); };
  find(folder, "summary\\.json");
  find(folder, "plots\\.png(\\.part[0-9]*(-[0-9]+)?)?");
  find(folder, "(attachments|contacts|probes|sensors|tools)\\.csv");
  find(folder, "(summary\\.json|.*\\.csv)\\.part[0-9]*(-[0-9]+)?");
  find(folder + "/states", "(.*_[0-9]{6}|last_.*)\\.vtu|index\\.csv|.*\\.(vtu|csv)\\.part[0-9]*(-[0-9]+)?");
  find(folder + "/nodes", ".*\\.csv(\\.part[0-9]*(-[0-9]+)?)?");
  find(folder + "/recording", "(run\\.json|states\\.csv|[0-9]{6}\\.state)(\\.part[0-9]*(-[0-9]+)?)?");
  find(folder, "bodies\\.csv");
  if (!found.empty() && !is_of_a_run(folder))
    throw Failure(kBadInput, name_of(found.front()) +
                                 ": a run would remove this file, which no run wrote; give another folder "
                                 "with --out");
  find(folder + "/frames", "frame_[0-9]{6,}\\.png(\\.part[0-9]*(-[0-9]+)?)?");
  for (const fs::path &path : found) {
    std::error_code refused;
    if (!fs::remove(path, refused) && refused)
      throw Failure(kBadInput,
                    name_of(path) + ": left by an earlier run, and cannot be removed: " + refused.message());
  }
}

}  // namespace

void make_folder(const std::string &path) {
  std::error_code error;
  fs::create_directories(path_of(path), error);
  if (error || !fs::is_directory(path_of(path)))
    throw Failure(kBadInput, path + ": the folder cannot be made: " +
                                 (error ? error.message() : "a file of that name is there"));
}

HeldFolder::HeldFolder(const std::string &path) {
  make_folder(path);
  const os::Hold hold = os::hold_folder(path, held_);
  if (hold == os::Hold::impossible)
    throw Failure(kBadInput, path + ": the folder cannot be opened: " + std::strerror(errno));
  if (hold == os::Hold::held_by_another)
    throw Failure(kBadInput, path +
                                 ": another run is writing into this folder; wait for its end, or give "
                                 "another one with --out");
  if (hold == os::Hold::unlocked)
    warn(path + ": this file system cannot lock the folder (" + std::strerror(errno) +
         "); let no other run write into it meanwhile");
}

HeldFolder::~HeldFolder() { os::let_go(held_); }

RunFolder::RunFolder(const std::string &path) : held_(path) {
  refuse_linked_folders(path);
  remove_earlier(path);
}

}  // namespace cli
