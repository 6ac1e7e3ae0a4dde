// deform mesh info FILE | make SHAPE --out FILE | convert IN OUT | fill SURFACE | from-labels VOLUME |
// phantom KIND
#include "cmd_mesh.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>

#include "arguments.h"
#include "become.h"
#include "file.h"
#include "messages.h"
#include "progress.h"
#include "system.h"

namespace cli {

std::string mesh_ending(const std::string &path) {
  const size_t slash = path.find_last_of('/'), dot = path.find_last_of('.');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) return "";
  std::string ending = path.substr(dot + 1);
  for (char &c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

Writes written_by(const std::string &path) {
  const std::string ending = mesh_ending(path);
  for (const char *e : {"msh", "msh2", "mesh"})
    if (ending == e) return Writes::cells;
  for (const char *e : {"obj", "ply", "stl", "off"})
    if (ending == e) return Writes::surface;
  return Writes::either;
}

namespace {

// The name under which a remedy saves a filling: VTU keeps the shares of the cells.
std::string filling_file(const std::string &out) {
  return shown_word(name_of(path_of(out).replace_extension(".vtu")));
}

constexpr const char *kIn =
    "mesh of any format that is read: .msh .vtk .vtu .mesh .inp .ele .vol .obj .ply .stl .off";

bool open(MeshSession &s, const std::string &file, uint32_t what = DFM_MESH_ANY) {
  return s.context && dfm_mesh_load(s.context, file.c_str(), what, &s.mesh) >= 0;
}

int info(const Globals &globals, const std::string &file) {
  MeshSession s(globals);
  {
    const Patience patience(show_progress(globals), "reading " + file);
    if (!open(s, file)) return fail(dfm_last_error());
  }
  return report_mesh(globals, file, s, true);
}

}  // namespace

std::string lost_shares(const dfm_mesh_info &cells, const std::string &out) {
  const std::string ending = mesh_ending(out);
  if (!cells.share || ending == "vtk" || ending == "vtu") return "";
  return "the share of material of each cell, which only .vtk and .vtu store: every cell of ." + ending +
         " counts whole in mass and stiffness; write .vtu";
}

namespace {

// What `out` cannot say of the mesh that was read.
std::vector<std::string> losses(const dfm_mesh_info &i, const std::string &out) {
  std::vector<std::string> lost;
  const std::string ending = mesh_ending(out);
  if (i.ntet) {
    if (i.ngroup && ending == "mesh") lost.push_back("names of groups (Medit stores only their numbers)");
    if (const std::string shares = lost_shares(i, out); !shares.empty()) lost.push_back(shares);
    return lost;
  }
  if (ending == "stl") lost.push_back("digits beyond the first 7 (STL stores single precision)");
  if (i.ngroup && ending == "ply") lost.push_back("names of groups (PLY stores only their numbers)");
  if (i.ngroup && (ending == "stl" || ending == "off"))
    lost.push_back(std::to_string(i.ngroup) + (i.ngroup == 1 ? " group" : " groups") +
                   " of triangles, without which ." + ending + " is written");
  return lost;
}

// Reads, drops what `out` cannot hold and says so in `lost`, writes.
int convert_file(MeshSession &s, const std::string &in, const std::string &out,
                 std::vector<std::string> &lost) {
  std::string sentence;
  if (!s.context) return fail(dfm_last_error());
  if (!import_surface(in, s, sentence)) return fail(sentence);
  if (s.mesh) lost.push_back("materials, normals, textures and animation");
  else if (!open(s, in)) return fail(dfm_last_error());
  const dfm_mesh_info i = s.info();
  if (!i.ntet && written_by(out) == Writes::cells)
    return fail(out + ": ." + mesh_ending(out) + " is written with tetrahedra, and " + in +
                " is a surface; fill it: deform mesh fill " + shown_word(in) + " --out " + filling_file(out) +
                ", or convert it to .obj, .ply, .stl, .off, .vtk or .vtu");
  if (i.ntet && written_by(out) == Writes::surface) {
    lost.push_back(std::to_string(i.ntet) + (i.ntet == 1 ? " tetrahedron" : " tetrahedra") + ", of which ." +
                   mesh_ending(out) + " holds the boundary alone");
    if (!open(s, in, DFM_MESH_SURFACE)) return fail(dfm_last_error());
  }
  if (dfm_mesh_write(s.mesh, out.c_str()) < 0) return fail(dfm_last_error());
  for (const std::string &l : losses(s.info(), out)) lost.push_back(l);
  return kDone;
}

int convert(const Globals &globals, const std::string &in, const std::string &out) {
  refuse_same("OUT", out, in);
  MeshSession s(globals);
  std::vector<std::string> lost;
  {
    const Patience patience(show_progress(globals), "converting " + in);
    if (const int failed = convert_file(s, in, out, lost)) return failed;
  }
  return report_mesh(globals, out, s, false, lost);
}

struct Shape {
  std::string kind, out;
  uint32_t cells = 1000, order = 1;
  double radius = 0.2, inner = 0.15, ring = 0.5, length = 1;
  std::vector<double> edges{1, 0.1, 0.1};
  bool surface = false;
  std::vector<double> size() const {
    if (kind == "ball") return {radius, 0, 0};
    if (kind == "cylinder") return {radius, length, 0};
    if (kind == "tube") return {inner, radius, length};
    if (kind == "torus") return {ring, radius, 0};
    return edges;
  }
};

int make(const Globals &globals, const Shape &shape) {
  MeshSession s(globals);
  const std::vector<double> size = shape.size();
  const Writes writes = written_by(shape.out);
  const bool surface =
      shape.surface || writes == Writes::surface || (shape.kind == "torus" && writes == Writes::either);
  if (surface && writes == Writes::cells)
    return fail(shape.out + ": ." + mesh_ending(shape.out) +
                " is written with tetrahedra; write a surface as .obj, .ply, .stl, .off, .vtk or .vtu");
  if (surface && shape.order == 2)
    return fail(shape.out + ": --order 2 is of cells, and this is a surface; leave it out");
  if (!s.context) return fail(dfm_last_error());
  if (!surface && shape.kind == "torus")
    return fail(shape.out +
                ": a torus is made as a surface; write .obj, .ply, .stl, .off, .vtk or .vtu, then: deform "
                "mesh fill SURFACE --out " +
                filling_file(shape.out));
  {
    const Patience patience(show_progress(globals), "making " + shape.out);
    const char *const kind = surface && shape.kind == "bricks" ? "beam" : shape.kind.c_str();
    if (dfm_mesh_make(s.context, kind, size.data(), surface ? DFM_MESH_SURFACE : DFM_MESH_CELLS, shape.cells,
                      &s.mesh) < 0 ||
        (shape.order == 2 && dfm_mesh_second_order(s.mesh, &s.mesh) < 0) ||
        dfm_mesh_write(s.mesh, shape.out.c_str()) < 0)
      return fail(dfm_last_error());
  }
  return report_mesh(globals, shape.out, s, false);
}

void add_make(Command mesh, Globals &globals, int *exit_code) {
  struct Kind { const char *name, *about; };
  Command command =
      mesh.command("make", "a cylinder, beam, ball, tube or torus, of near-isotropic cells or as a surface");
  command.needs_subcommand();
  for (const Kind &kind :
       {Kind{"cylinder", "axis z, base at the origin"}, Kind{"beam", "edges from the origin"},
        Kind{"bricks", "a beam of hexahedra"}, Kind{"ball", "about the origin"},
        Kind{"tube", "a cylinder with a hole; axis z, base at the origin"},
        Kind{"torus", "a surface; about the origin, axis z"}}) {
    const std::string name = kind.name;
    Command sub = command.command(name, kind.about);
    const auto shape = std::make_shared<Shape>();
    shape->kind = name;
    if (name == "ball" || name == "torus") shape->radius = 0.1;
    sub.option("--out", shape->out,
               "file to write: cells as .msh (MSH 4.1), .msh2 (MSH 2.2), .mesh, .vtk or .vtu, a surface "
               "as .obj, .ply, .stl or .off")
        .required()
        .type_name("FILE");
    sub.option("--cells", shape->cells, "about how many tetrahedra, or triangles of a surface")
        .with_default()
        .type_name("N");
    if (name == "beam" || name == "bricks")
      sub.option("--size", shape->edges, "edges x y z, m").values(3).with_default();
    else
      sub.option("--radius", shape->radius,
                 name == "tube"    ? "outer, m"
                 : name == "torus" ? "of the tube, m"
                                   : "m")
          .with_default();
    if (name == "tube") sub.option("--inner", shape->inner, "inner radius, m").with_default();
    if (name == "torus") sub.option("--ring", shape->ring, "radius of the ring, m").with_default();
    if (name == "cylinder" || name == "tube") sub.option("--length", shape->length, "m").with_default();
    if (name != "torus")
      sub.option("--order", shape->order,
                 name == "bricks" ? "2: hexahedra of 27 points" : "2: second-order tetrahedra")
          .with_default()
          .one_of({"1", "2"})
          .type_name("1|2");
    sub.flag("--surface", shape->surface, "the surface alone, also as .vtk or .vtu");
    sub.calls([=, &globals] { *exit_code = make(globals, *shape); });
  }
}

}  // namespace

void add_mesh(Command app, Globals &globals, int *exit_code) {
  Command mesh = app.command("mesh", "counts, quality and defects of meshes; generators; formats");
  mesh.needs_subcommand();
  const auto first = std::make_shared<std::string>(), second = std::make_shared<std::string>();

  Command info_command = mesh.command("info", "counts, quality, groups and what had to be repaired");
  info_command.option("FILE", *first, kIn).required();
  info_command.calls([=, &globals] { *exit_code = info(globals, *first); });

  add_make(mesh, globals, exit_code);

  Command convert_command = mesh.command("convert",
                                         "reads IN and writes OUT in the format of its file name "
                                         "ending; a surface format gets the boundary of the cells");
  convert_command
      .option("IN", *first, std::string(kIn) + "; glTF, FBX, COLLADA and others where built with assimp")
      .required();
  convert_command
      .option("OUT", *second, ".msh (MSH 4.1), .msh2 (MSH 2.2), .mesh, .vtk, .vtu, .obj, .ply, .stl or .off")
      .required();
  convert_command.calls([=, &globals] { *exit_code = convert(globals, *first, *second); });

  add_mesh_fill(mesh, globals, exit_code);
  add_program(mesh, globals, kFromLabels);
  add_program(mesh, globals, kPhantom);
}

}  // namespace cli
