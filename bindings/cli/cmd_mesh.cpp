// deform mesh info FILE | make cylinder, beam or ball --out FILE | convert IN OUT; fill has its own file
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "cli.h"
#include "json_text.h"

namespace cli {
namespace {

// Warnings of the reader belong to the report of this command, so its context logs nothing by itself.
struct Session {
  dfm_context *context = nullptr;
  dfm_tetmesh mesh = 0;
  explicit Session(const Globals &globals) {
    dfm_context_def def = dfm_context_def_default();
    def.threads = globals.threads;
    def.log = [](void *, int32_t, const char *) {};
    if (dfm_context_create(&def, &context) < 0) context = nullptr;
  }
  ~Session() { dfm_context_destroy(context); }
  Session(const Session &) = delete;
  Session &operator=(const Session &) = delete;
};

struct Defect { const char *key; uint32_t count; };

std::vector<Defect> defects(const dfm_tetmesh_info &i) {
  return {{"turned", i.turned}, {"dropped_points", i.dropped_points}, {"dropped_cells", i.dropped_cells}, {"flat_cells", i.flat_cells},
          {"duplicate_points", i.duplicate_points}, {"nonmanifold_edges", i.nonmanifold_edges}, {"overlapping_faces", i.overlapping_faces}};
}

std::vector<std::string> lines(const char *text) {
  std::vector<std::string> out;
  for (const char *c = text; *c;) {
    const char *end = c;
    while (*end && *end != '\n') ++end;
    out.emplace_back(c, end);
    c = *end ? end + 1 : end;
  }
  return out;
}

struct Group { std::string name; uint32_t dimension = 0, points = 0; };

std::vector<Group> groups(dfm_tetmesh mesh, const dfm_tetmesh_info &info) {
  const char *const *names = nullptr;
  dfm_tetmesh_groups(mesh, &names, nullptr);
  std::vector<Group> out(info.ngroup);
  for (uint32_t k = 0; k < info.ngroup; ++k) {
    out[k].name = names[k];
    dfm_tetmesh_group_points(mesh, k, &out[k].dimension, nullptr, &out[k].points);
  }
  return out;
}

void print_json(const std::string &file, dfm_tetmesh mesh, const dfm_tetmesh_info &i) {
  const auto whole = [](uint64_t n) { return std::to_string(n); };
  std::vector<std::string> histogram, names, warnings;
  for (const uint32_t n : i.quality_histogram) histogram.push_back(whole(n));
  for (const Group &g : groups(mesh, i))
    names.push_back(JsonObject().add("name", quoted(g.name)).add("dimension", whole(g.dimension)).add("points", whole(g.points)).text());
  for (const std::string &w : lines(i.warnings)) warnings.push_back(quoted(w));
  JsonObject out, edge, quality, found;
  for (const Defect &d : defects(i)) found.add(d.key, whole(d.count));
  edge.add("min", number(i.edge_min)).add("median", number(i.edge_median)).add("max", number(i.edge_max));
  quality.add("min", number(i.quality_min)).add("mean", number(i.quality_mean)).add("histogram", json_array(histogram));
  out.add("file", quoted(file)).add("points", whole(i.npoint)).add("tets", whole(i.ntet)).add("surface_triangles", whole(i.ntriangle));
  out.add("edges", whole(i.nedge)).add("pieces", whole(i.npiece)).add("volume", number(i.volume));
  out.add("lo", json_vector(i.lo)).add("hi", json_vector(i.hi)).add("edge", edge.text()).add("quality", quality.text());
  out.add("defects", found.text()).add("groups", json_array(names)).add("warnings", json_array(warnings));
  std::fputs(indented(out.text()).c_str(), stdout);
}

void print_table(const std::string &file, dfm_tetmesh mesh, const dfm_tetmesh_info &i) {
  std::printf("%s\n", file.c_str());
  std::printf("  points            %u\n  tetrahedra        %u\n  surface triangles %u\n", i.npoint, i.ntet, i.ntriangle);
  std::printf("  edges             %u\n  pieces            %u\n  volume            %.10g m3\n", i.nedge, i.npiece, i.volume);
  std::printf("  box               %g %g %g to %g %g %g m\n", i.lo[0], i.lo[1], i.lo[2], i.hi[0], i.hi[1], i.hi[2]);
  std::printf("  edge length       %.4g to %.4g m, median %.4g\n", i.edge_min, i.edge_max, i.edge_median);
  std::printf("  mean ratio        least %.3g, mean %.3g (1: regular)\n", i.quality_min, i.quality_mean);
  for (int bin = 0; bin < 10; ++bin)
    if (i.quality_histogram[bin]) std::printf("    %.1f to %.1f      %u\n", 0.1 * bin, 0.1 * (bin + 1), i.quality_histogram[bin]);
  static const char *const kElements[4] = {"points", "lines", "triangles", "cells"};
  for (const Group &g : groups(mesh, i))
    std::printf("  group             %s (%s, %u points)\n", g.name.c_str(), kElements[g.dimension < 4 ? g.dimension : 3], g.points);
  for (const std::string &w : lines(i.warnings)) std::printf("  warning: %s\n", w.c_str());
}

// What a mesh command tells when it is done; quiet says nothing but errors and what was asked for.
int report(const Globals &globals, const std::string &file, dfm_tetmesh mesh, bool asked) {
  dfm_tetmesh_info info = {};
  info.size = sizeof info;
  if (dfm_tetmesh_get_info(mesh, &info) < 0) return fail(dfm_last_error());
  if (globals.json) print_json(file, mesh, info);
  else if (asked) print_table(file, mesh, info);
  else if (!globals.quiet) {
    for (const std::string &w : lines(info.warnings)) std::fprintf(stderr, "deform: warning: %s\n", w.c_str());
    std::printf("%s: %u points, %u tetrahedra, %u surface triangles, least mean ratio %.3g\n", file.c_str(), info.npoint, info.ntet,
                info.ntriangle, info.quality_min);
  }
  return kDone;
}

int info(const Globals &globals, const std::string &file) {
  Session s(globals);
  if (!s.context || dfm_tetmesh_read(s.context, file.c_str(), &s.mesh) < 0) return fail(dfm_last_error());
  return report(globals, file, s.mesh, true);
}

int make(const Globals &globals, const std::string &kind, const double *size, uint32_t cells, const std::string &out) {
  Session s(globals);
  if (!s.context || dfm_tetmesh_make(s.context, kind.c_str(), size, cells, &s.mesh) < 0 || dfm_tetmesh_write(s.mesh, out.c_str()) < 0)
    return fail(dfm_last_error());
  return report(globals, out, s.mesh, false);
}

int convert(const Globals &globals, const std::string &in, const std::string &out) {
  Session s(globals);
  if (!s.context || dfm_tetmesh_read(s.context, in.c_str(), &s.mesh) < 0 || dfm_tetmesh_write(s.mesh,
      out.c_str()) < 0) return fail(dfm_last_error());
  return report(globals, out, s.mesh, false);
}

struct Shape { std::string out; uint32_t cells = 1000; double radius = 0, length = 1; std::vector<double> size{1, 0.1, 0.1}; };

void add_make(CLI::App *mesh, Globals &globals, int *exit_code) {
  CLI::App *command = mesh->add_subcommand("make", "a cylinder, beam or ball of near-isotropic cells");
  command->require_subcommand(1);
  for (const char *kind : {"cylinder", "beam", "ball"}) {
    const std::string name = kind;
    CLI::App *sub = command->add_subcommand(name,
        name == "beam" ? "edges from the origin" : name == "ball" ? "about the origin" : "axis z, base at the origin");
    const auto shape = std::make_shared<Shape>();
    shape->radius = name == "ball" ? 0.1 : 0.2;
    sub->add_option("--out", shape->out, "file to write: .msh (MSH 4.1), .msh2 (MSH 2.2) or .vtk")->required()->type_name("FILE");
    sub->add_option("--cells", shape->cells, "about how many tetrahedra")->capture_default_str()->type_name("N");
    if (name != "beam") sub->add_option("--radius", shape->radius, "m")->capture_default_str();
    if (name == "cylinder") sub->add_option("--length", shape->length, "m")->capture_default_str();
    if (name == "beam") sub->add_option("--size", shape->size, "edges x y z, m")->expected(3)->capture_default_str();
    sub->callback([=, &globals] {
      std::vector<double> size = shape->size;
      if (name == "ball") size = {shape->radius, 0, 0};
      if (name == "cylinder") size = {shape->radius, shape->length, 0};
      *exit_code = make(globals, name, size.data(), shape->cells, shape->out);
    });
  }
}

}  // namespace

void add_mesh(CLI::App &app, Globals &globals, int *exit_code) {
  CLI::App *mesh = app.add_subcommand("mesh", "counts, quality and defects of meshes; generators; formats");
  mesh->require_subcommand(1);
  const auto first = std::make_shared<std::string>(), second = std::make_shared<std::string>();

  CLI::App *info_command = mesh->add_subcommand("info", "counts, quality, groups and what had to be repaired");
  info_command->add_option("FILE", *first, "MSH 2.2 or 4.1, or legacy VTK")->required();
  info_command->callback([=, &globals] { *exit_code = info(globals, *first); });

  add_make(mesh, globals, exit_code);

  CLI::App *convert_command = mesh->add_subcommand("convert", "reads IN, writes OUT by its file name ending");
  convert_command->add_option("IN", *first, "MSH 2.2 or 4.1, or legacy VTK")->required();
  convert_command->add_option("OUT", *second, ".msh (MSH 4.1), .msh2 (MSH 2.2) or .vtk (legacy VTK)")->required();
  convert_command->callback([=, &globals] { *exit_code = convert(globals, *first, *second); });

  add_mesh_fill(mesh, globals, exit_code);
}

}  // namespace cli
