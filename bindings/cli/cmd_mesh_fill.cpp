// deform mesh fill SURFACE --out FILE --cells N
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "arguments.h"
#include "cell_volume.h"
#include "cmd_mesh.h"
#include "json_text.h"
#include "progress.h"
#include "system.h"

namespace cli {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

struct Filled {
  dfm_mesh_info surface = {}, cells = {};
  double volume = 0, mean_share = 0, least_share = 1, seconds = 0;
  std::vector<std::string> warnings;
  bool imported = false;  // from a format that scenes do not read
};

void measure(Filled &out) {
  for (uint32_t t = 0; t < out.cells.ntet; ++t) {
    const double part = out.cells.share ? out.cells.share[t] : 1;
    out.volume += part * cell_volume(out.cells.points, out.cells.tets + 4 * size_t(t));
    out.mean_share += part / out.cells.ntet;
    out.least_share = part < out.least_share ? part : out.least_share;
  }
  out.warnings = lines_of(out.surface.warnings);
  for (const std::string &w : lines_of(out.cells.warnings)) out.warnings.push_back(w);
}

void print_json(const std::string &in, const std::string &file, uint32_t wanted, const Filled &f) {
  JsonObject out;
  out.add("surface", quoted(in), "file", quoted(file), "triangles", f.surface.ntriangle, "wanted", wanted);
  out.add("cells", f.cells.ntet, "points", f.cells.npoint, "pieces", f.cells.npiece);
  out.add("enclosed_volume", f.volume, "cells_volume", f.cells.volume, "mean_share", f.mean_share);
  out.add("least_share", f.least_share, "edge_median", f.cells.edge_median, "seconds", f.seconds);
  out.add("open_edges", f.surface.open_edges, "holes", f.surface.holes, "turned", f.surface.turned);
  out.add("warnings", json_words(f.warnings));
  std::fputs(indented(out.text()).c_str(), stdout);
}

void print_table(const std::string &in, const std::string &file, uint32_t wanted, const Filled &f) {
  std::printf("%s: %u triangles, filled into %s\n", shown(in).c_str(), f.surface.ntriangle,
              shown(file).c_str());
  std::printf("  cells             %u\n  points            %u\n  pieces            %u\n", f.cells.ntet,
              f.cells.npoint, f.cells.npiece);
  std::printf("  enclosed volume   %.6g m3\n", f.volume);
  std::printf("  share of material mean %.3f, least %.3f\n", f.mean_share, f.least_share);
  std::printf("  edge length       %.4g to %.4g m\n", f.cells.edge_min, f.cells.edge_max);
  std::printf("  seconds           %.2f\n", f.seconds);
  for (const std::string &w : f.warnings) std::printf("  warning: %s\n", shown(w).c_str());
  if (f.surface.warnings[0] == 0 && f.cells.warnings[0] == 0) std::printf("  the surface is clean\n");
  if (f.imported || wanted == 0) return;
  // The file alone would be drawn, and would touch, with the jagged border of its cells.
  const auto whole = [](const std::string &path) {
    return shown(quoted(name_of(std::filesystem::absolute(path_of(path)).lexically_normal())));
  };
  std::printf("  body of a scene   \"mesh\": %s, \"surface\": {\"mesh\": %s}%s\n", whole(file).c_str(),
              whole(in).c_str(),
              unit_hint(f.surface.lo, f.surface.hi).empty() ? "" : ", \"pose\": {\"scale\": 0.001}");
}

int fill(const Globals &globals, const std::string &in, const std::string &out, uint32_t cells) {
  MeshSession s(globals);
  Filled filled;
  const Clock::time_point begin = Clock::now();
  {
    const Patience patience(show_progress(globals), "filling " + in);
    if (!s.context) return fail(dfm_last_error());
    std::string sentence;
    if (!import_surface(in, s, sentence)) return fail(sentence);
    filled.imported = s.mesh != 0;
    if (!s.mesh && dfm_mesh_load(s.context, in.c_str(), DFM_MESH_SURFACE, &s.mesh) < 0)
      return fail(dfm_last_error());
    filled.surface = s.info();
    if (dfm_mesh_fill(s.mesh, cells, &s.mesh) < 0) return fail(in + ": " + dfm_last_error());
    filled.cells = s.info();
    if (dfm_mesh_write(s.mesh, out.c_str()) < 0) return fail(dfm_last_error());
  }
  filled.seconds = seconds_since(begin);
  measure(filled);
  if (const std::string hint = unit_hint(filled.surface.lo, filled.surface.hi);
      !filled.imported && !hint.empty())
    filled.warnings.push_back(hint);
  if (const std::string lost = lost_shares(filled.cells, out); !lost.empty())
    filled.warnings.push_back("not kept: " + lost);
  if (globals.json) print_json(in, out, cells, filled);
  else if (!globals.quiet) print_table(in, out, cells, filled);
  return kDone;
}

struct FillOptions {
  std::string surface, out;
  uint32_t cells = 5000;
};

}  // namespace

void add_mesh_fill(Command mesh, Globals &globals, int *exit_code) {
  Command command = mesh.command(
      "fill", "fills a closed surface with tetrahedra; in a scene, the body key \"fill\" does the same");
  const auto options = std::make_shared<FillOptions>();
  command
      .option("SURFACE", options->surface,
              "OBJ, PLY, STL, OFF, or any file with triangles that mesh info or mesh convert reads")
      .required();
  command.option("--out", options->out, "file to write: .msh (MSH 4.1), .msh2 (MSH 2.2), .mesh, .vtk or .vtu")
      .required()
      .type_name("FILE");
  command
      .option("--cells", options->cells,
              "about how many tetrahedra; 0: from one inner point to the triangles")
      .with_default()
      .type_name("N");
  command.calls(
      [=, &globals] { *exit_code = fill(globals, options->surface, options->out, options->cells); });
}

}  // namespace cli
