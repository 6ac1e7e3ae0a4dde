#include "study.h"

#include <filesystem>
#include <memory>

#include "cli.h"
#include "messages.h"
#include "run_folder.h"

namespace fs = std::filesystem;

namespace cli::cost {
namespace {

// Keys of a body that name parts of its mesh file: groups, cells by number, nodes by number.
std::string named_part(const Subject &subject, const std::string &body) {
  for (const char *key : {"/materials_by_group", "/fields", "/nodal_bc", "/anisotropy/field"})
    if (subject.find(body + key)) return std::string(key).substr(1);
  for (const char *list : {"/fix", "/forces", "/springs"}) {
    const JsonValue *const rows = subject.find(body + list);
    for (size_t i = 0; rows && i < rows->items.size(); ++i)
      if (rows->items[i].find("group")) return std::string(list).substr(1) + " by group";
  }
  return "";
}

std::string file_of(const Subject &subject, const std::string &pointer) {
  return (fs::path(subject.folder) / subject.find(pointer)->text).string();
}

}  // namespace

std::string why_cells_stay(const Subject &subject) {
  for (size_t i = 0; i < subject.bodies.size(); ++i) {
    const std::string body = "/bodies/" + std::to_string(i);
    const JsonValue *const mesh = subject.find(body + "/mesh");
    if (!mesh) return "body '" + subject.bodies[i].name + "' has no mesh of its own";
    if (subject.find(body + "/lattice"))
      return "body '" + subject.bodies[i].name + "' is a lattice, whose cells this study does not vary yet";
    if (mesh->kind == JsonValue::object) continue;
    const std::string part = named_part(subject, body);
    if (!part.empty() && !subject.find(body + "/fill"))
      return "body '" + subject.bodies[i].name + "' has " + part +
             ", which belongs to the cells of its file and not to others";
    if (subject.find(body + "/surface/mesh"))
      return "body '" + subject.bodies[i].name + "' has a separate surface";
  }
  return "";
}

Surfaces write_surfaces(const Subject &subject, const std::string &folder) {
  Surfaces out(subject.bodies.size());
  dfm_context_def def = dfm_context_def_default();
  def.log = [](void *, int32_t, const char *) {};
  dfm_context *raw = nullptr;
  need(dfm_context_create(&def, &raw));
  const std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)> context(raw, dfm_context_destroy);
  for (size_t i = 0; i < subject.bodies.size(); ++i) {
    const std::string pointer = "/bodies/" + std::to_string(i) + "/mesh";
    const JsonValue *const mesh = subject.find(pointer);
    if (!mesh || mesh->kind != JsonValue::string) continue;
    const std::string file = file_of(subject, pointer);
    uint32_t kind = 0;
    need(dfm_mesh_file_kind(context.get(), file.c_str(), &kind));
    if (kind != DFM_MESH_TETS) continue;
    dfm_trimesh surface = 0;
    need(dfm_trimesh_read(context.get(), file.c_str(), &surface));
    make_folder(folder);
    const fs::path path = fs::absolute(fs::path(folder) / (subject.bodies[i].name + ".obj"));
    const dfm_status status = dfm_trimesh_write(surface, path.c_str());
    dfm_trimesh_destroy(surface);
    need(status);
    out[i] = path.string();
  }
  return out;
}

}  // namespace cli::cost
