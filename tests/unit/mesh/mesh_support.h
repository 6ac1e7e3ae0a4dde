// What the mesh tests share: memory that counts and refuses, files by folder, the sentence of a refusal.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "deform/plugin.h"
#include "mesh/cells.h"
#include "mesh/mesh.h"
#include "support.h"

namespace test {

// Counts what is held, remembers the peak, and refuses beyond a cap or from the n-th call on.
struct CountedMemory {
  size_t held = 0, peak = 0, cap = SIZE_MAX, calls = 0, refuse_from = SIZE_MAX;
  dfm::Memory hooks;
  CountedMemory() {
    hooks.user = this;
    hooks.alloc = [](void *user, size_t bytes, size_t align) -> void * {
      CountedMemory &m = *static_cast<CountedMemory *>(user);
      if (++m.calls > m.refuse_from || bytes > m.cap - std::min(m.cap, m.held)) return nullptr;
      m.held += bytes;
      m.peak = std::max(m.peak, m.held);
      return std::aligned_alloc(align, (std::max<size_t>(bytes, 1) + align - 1) / align * align);
    };
    hooks.release = [](void *user, void *p, size_t bytes, size_t) {
      static_cast<CountedMemory *>(user)->held -= bytes;
      std::free(p);
    };
  }
  CountedMemory(const CountedMemory &) = delete;
  CountedMemory &operator=(const CountedMemory &) = delete;
};

inline std::vector<std::string> files_of(const std::string &folder, const std::vector<std::string> &endings) {
  std::vector<std::string> out;
  for (const auto &entry : std::filesystem::directory_iterator(folder))
    for (const std::string &ending : endings)
      if (entry.path().extension() == ending) out.push_back(entry.path().string());
  std::sort(out.begin(), out.end());
  return out;
}
// Compressed files are, where the library has zlib.
inline bool is_readable(const std::string &file) {
#ifdef DEFORM_HAVE_ZLIB
  return !file.empty();
#else
  return file.find("zlib") == std::string::npos;
#endif
}
inline std::vector<std::string> own_meshes() {
  auto files = files_of(std::string(DEFORM_SOURCE_DIR) + "/tests/data/meshes",
                        {".msh", ".vtk", ".vtu", ".mesh", ".inp", ".vol"});
  EXPECT_EQ(files.size(), 31u);
  std::erase_if(files, [](const std::string &file) { return !is_readable(file); });
  return files;
}
inline std::vector<std::string> own_surfaces() {
  return files_of(std::string(DEFORM_SOURCE_DIR) + "/tests/data/surfaces",
                  {".obj", ".ply", ".stl", ".off", ".vtk", ".vtp", ".mesh", ".msh"});
}

// The error of reading; none where it is read.
template <class Read>
std::optional<dfm::Error> error_of(Read read) {
  try {
    read();
  } catch (const dfm::Error &e) {
    return e;
  }
  return std::nullopt;
}
inline std::optional<dfm::Error> refusal(const std::string &path,
                                         const dfm::Memory &memory = dfm::Memory::standard()) {
  return error_of([&] { dfm::read_mesh(memory, path, DFM_MESH_CELLS); });
}
inline std::optional<dfm::Error> refusal_of_text(const std::string &name, const std::string &text) {
  const std::string path = scratch("mesh") + "/" + name;
  write_file(path, text);
  return refusal(path);
}

// Its sentence begins so, and holds all of the words.
inline void expect_error(const std::optional<dfm::Error> &error, dfm_status status,
                         const std::vector<std::string> &words, const std::string &begin = "") {
  ASSERT_TRUE(error) << "it was read" << (words.empty() ? "" : ", in spite of " + words[0]);
  EXPECT_EQ(error->status, status) << error->sentence;
  EXPECT_EQ(error->sentence.rfind(begin, 0), 0u) << error->sentence;
  for (const std::string &word : words)
    EXPECT_NE(error->sentence.find(word), std::string::npos) << "no '" << word << "' in: " << error->sentence;
}
inline void expect_refusal(const std::string &name, const std::string &text, dfm_status status,
                           const std::vector<std::string> &words) {
  SCOPED_TRACE(name + ":\n" + text.substr(0, 200));
  expect_error(refusal_of_text(name, text), status, words);
}

// The first 20 points of each cell, and no others.
inline dfm::RestMesh of_twenty(const dfm::RestMesh &mesh) {
  dfm::RestMesh out;
  out.cell = DFM_CELL_HEX20;
  std::map<uint32_t, uint32_t> number;
  for (size_t c = 0; c < mesh.cells.size(); ++c)
    if (c % 27 < 20) number.emplace(mesh.cells[c], 0);
  for (auto &[p, n] : number) {
    n = out.npoint();
    out.points.insert(out.points.end(), &mesh.points[3 * size_t{p}], &mesh.points[3 * size_t{p}] + 3);
    out.file_point.push_back(n);
  }
  for (size_t c = 0; c < mesh.cells.size(); ++c)
    if (c % 27 < 20) out.cells.push_back(number.at(mesh.cells[c]));
  out.tets = dfm::tets_of(dfm::Memory::standard(), dfm::cell_kind(out.cell), out.cells);
  out.tet_group.assign(out.ntet(), dfm::kNoGroup);
  return out;
}

}  // namespace test
