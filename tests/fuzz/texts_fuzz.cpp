// Any bytes as one of the text files that are no scene and no mesh of one file: an error with a sentence, or
// what was read. The first byte chooses the reader.
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "friction/case.h"
#include "fuzz_file.h"
#include "json_text.h"
#include "mesh/raw_mesh.h"
#include "messages.h"
#include "scene/planner/planner.h"
#include "scene/table.h"

namespace {

using Bytes = std::string_view;

dfm::scene::BodyMesh block() {  // as a scene's reader has it
  static const double size[3] = {0.1, 0.1, 0.1};
  static dfm_mesh_handle mesh = 0;
  if (!mesh && dfm_mesh_make(fuzz::context(), "beam", size, DFM_MESH_CELLS, 10, &mesh) != DFM_OK)
    std::abort();
  dfm_mesh_info info{};
  info.size = sizeof info;
  dfm::scene::BodyMesh out;
  if (dfm_mesh_get_info(mesh, &info) != DFM_OK) std::abort();
  out.points.assign(info.points, info.points + 3 * size_t{info.npoint});
  out.info = info;
  return out;
}

// Three files one behind the other, divided by lines of "%%".
void tetgen(Bytes text) {
  static const struct Folder {
    const std::string name = "/tmp/deform_fuzz_" + std::to_string(getpid());
    Folder() { std::filesystem::create_directories(name); }
    ~Folder() { std::filesystem::remove_all(name); }
  } folder;
  const std::string first(text.substr(0, text.find("%%\n")));
  for (const char *const ending : {"/a.node", "/a.ele", "/a.face"}) {
    const size_t end = text.find("%%\n");
    const Bytes part = text.substr(0, end);
    std::FILE *const file = std::fopen((folder.name + ending).c_str(), "wb");
    if (!file || std::fwrite(part.data(), 1, part.size(), file) != part.size() || std::fclose(file))
      std::abort();
    text = end == Bytes::npos ? Bytes{} : text.substr(end + 3);
  }
  dfm::RawMesh raw(dfm::Memory::standard());
  const std::string path = folder.name + "/a.node";
  dfm::Cursor in(path, first.data(), first.size());
  dfm::read_tetgen(in, raw);
  if (!raw.tets.empty()) dfm::finish_mesh("fuzz", std::move(raw));
}

void read(unsigned reader, const std::string &path, Bytes text) {
  using namespace dfm::scene;
  static const BodyMesh mesh = block();
  switch (reader) {
    case 0: read_nodal(path, mesh); return;
    case 1: read_start_state(path, mesh); return;
    case 2: {
      Tool tool;
      tool.def = dfm_tool_def_default();
      tool.def.shape = DFM_TOOL_SCISSORS;
      read_hand(path, tool);
      return;
    }
    case 3: read_field(path, {"", "young", path, 1, false}, mesh); return;
    case 4: read_field(path, {"", "fibers", path, 3, true}, mesh); return;
    case 5:
      setenv("DEFORM_COSTS", path.c_str(), 1);
      read_costs();
      return;
    case 6: cli::read_case(path); return;
    case 7: tetgen(text); return;
    default: {
      cli::JsonValue value;
      cli::parse_json(std::string(text), value);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size == 0) return 0;
  const fuzz::File file(data + 1, size - 1);
  try {
    read(data[0] % 9u, file.path(), {reinterpret_cast<const char *>(data) + 1, size - 1});
  } catch (const dfm::Error &e) {
    if (e.sentence.empty()) std::abort();
  } catch (const cli::Failure &e) {
    if (!*e.what()) std::abort();
  }
  return 0;
}
