// deform-labels, started by `deform mesh from-labels` and `deform mesh phantom`.
#include <cstdio>
#include <memory>

#include "arguments.h"
#include "become.h"
#include "cmd_mesh.h"
#include "file.h"
#include "json_text.h"
#include "labels/label_scene.h"
#include "labels/phantom.h"
#include "messages.h"
#include "progress.h"

namespace cli {
namespace {

// Per cell; from here on contact of the surface, not the cells, decides what a step costs.
constexpr uint32_t kManyTriangles = 2;

std::string size_json(const std::array<uint32_t, 3> &n) {
  return json_array({json_of(n[0]), json_of(n[1]), json_of(n[2])});
}

std::string report_json(const labels::Report &r, const std::string &out) {
  std::vector<std::string> names, things, borders;
  for (const labels::LabelReport &l : r.labels)
    names.push_back(json_object("label", l.value, "name", quoted(l.name), l.obstacle ? "obstacle" : "body",
                                quoted(l.thing), "voxels", l.voxels, "changed", l.changed, "voxel_volume",
                                l.voxel_volume, "volume", l.volume, "triangles", l.triangles, "cells",
                                l.cells, "cell_volume", l.cell_volume, "at_border", l.at_border));
  for (const labels::ThingReport &t : r.things)
    things.push_back(json_object("name", quoted(t.name), "kind", t.obstacle ? "\"obstacle\"" : "\"body\"",
                                 "points", t.points, "triangles", t.triangles, "cells", t.cells,
                                 "quality_min", t.quality_min, "quality_mean", t.quality_mean, "farthest",
                                 t.farthest));
  for (const labels::Border &b : r.borders)
    borders.push_back(json_object("between", json_array({quoted(b.a), quoted(b.b)}), "points", b.points,
                                  "triangles", b.triangles, "kind", b.held ? "\"held\"" : "\"attached\"",
                                  "stiffness", b.stiffness));
  return json_object("scene_hash", quoted(r.scene_hash), "scene", quoted(out + "/scene.json"), "voxels",
                     size_json(r.size), "joined", size_json(r.factor), "labels", json_array(names), "parts",
                     json_array(things), "borders", json_array(borders), "open_edges", r.open_edges,
                     "crossing_pairs", r.crossing, "vertices_put_back", r.restored, "largest_volume_change",
                     r.largest_change, "warnings", json_words(r.warnings));
}

std::string three(double x) { return formatted("%.3f", x); }

void print_table(const labels::Report &r, const labels::Options &o) {
  std::printf("%s: %u x %u x %u voxels", shown(o.volume).c_str(), r.size[0], r.size[1], r.size[2]);
  if (r.factor != std::array<uint32_t, 3>{1, 1, 1})
    std::printf(", joined by %u x %u x %u", r.factor[0], r.factor[1], r.factor[2]);
  std::printf("\n  %-16s %-16s %10s %11s %11s %11s %9s %7s\n", "label", "part of", "voxels", "voxels, ml",
              "surface, ml", "cells, ml", "triangles", "cells");
  for (const labels::LabelReport &l : r.labels)
    std::printf("  %-16s %-16s %10zu %11.3f %11.3f %11s %9u %7s\n", shown(l.name).c_str(),
                shown(l.thing).c_str(), l.voxels, 1e6 * l.voxel_volume, 1e6 * l.volume,
                l.obstacle ? "" : three(1e6 * l.cell_volume).c_str(), l.triangles,
                l.obstacle ? "rigid" : std::to_string(l.cells).c_str());
  for (const labels::ThingReport &t : r.things)
    if (!t.obstacle)
      std::printf(
          "  %s: %u cells, %u triangles; quality of cells %.2f at least, %.2f on average (1: regular)\n",
          shown(t.name).c_str(), t.cells, t.triangles, t.quality_min, t.quality_mean);
  for (const labels::ThingReport &t : r.things)
    if (t.farthest > 0)
      std::printf("  %s: the boundary of its cells is its surface, within %.2g mm of that of its labels\n",
                  shown(t.name).c_str(), 1e3 * t.farthest);
  for (const labels::Border &b : r.borders)
    std::printf("  %s is %s %s at %u points of their border\n", shown(b.a).c_str(),
                b.held ? "held by" : "attached to", shown(b.b).c_str(), b.points);
  std::printf("  closed: %s; pairs of triangles that cross: %zu; largest change of a volume: %.2g %%\n",
              r.open_edges ? "no" : "yes", r.crossing, 100 * r.largest_change);
  if (r.restored) std::printf("  %zu vertices are smoothed less, so that no triangles cross\n", r.restored);
  for (const labels::ThingReport &t : r.things)
    if (!t.obstacle && t.triangles > kManyTriangles * t.cells)
      std::printf("  %s: contact takes time for each of its %u triangles; a larger --spacing makes fewer\n",
                  shown(t.name).c_str(), t.triangles);
  std::printf("deform run %s\n", shown_word(o.out + "/scene.json").c_str());
}

int from_labels(const Globals &globals, const labels::Options &options) {
  MeshSession s(globals);
  if (!s.context) return fail(dfm_last_error());
  labels::Report report;
  {
    const Patience patience(show_progress(globals), "making surfaces and bodies of " + options.volume);
    report = labels::make_scene(s.context, options);
  }
  write_whole(options.out + "/summary.json", indented(report_json(report, options.out)));
  if (globals.json) {
    std::fputs(indented(report_json(report, options.out)).c_str(), stdout);
  } else {
    if (!globals.quiet)
      for (const std::string &w : report.warnings)
        std::fprintf(stderr, "deform: warning: %s\n", shown(w).c_str());
    if (!globals.quiet) print_table(report, options);
  }
  return report.open_edges || report.crossing ? kFound : kDone;
}

int phantom(const Globals &globals, const std::string &kind, double voxel, const std::string &out) {
  const labels::Phantom made = labels::make_phantom(kind, 1e-3 * voxel);
  write_whole(out, labels::nrrd_text(made.volume));
  const labels::Volume &v = made.volume;
  if (globals.json) {
    std::vector<std::string> rows;
    for (size_t l = 1; l < v.value.size(); ++l)
      rows.push_back(
          json_object("label", v.value[l], "name", quoted(v.name.at(v.value[l])), "volume", made.exact[l]));
    std::fputs(indented(json_object("file", quoted(out), "labels", json_array(rows))).c_str(), stdout);
  } else if (!globals.quiet) {
    std::printf("%s: %u x %u x %u voxels of %g mm\n", shown(out).c_str(), v.size[0], v.size[1], v.size[2],
                voxel);
    for (size_t l = 1; l < v.value.size(); ++l)
      std::printf("  %lld  %-14s %10.3f ml\n", static_cast<long long>(v.value[l]),
                  v.name.at(v.value[l]).c_str(), 1e6 * made.exact[l]);
  }
  return kDone;
}

struct Given {
  labels::Options options;
  std::string unit, spacing = "auto", kind, out;
  double voxel = 4;
};

void add_commands(Command app, Globals &globals, int *exit_code) {
  Command mesh = app.command("mesh");
  const auto given = std::make_shared<Given>();
  Command command = mesh.command(kFromLabels.name, kFromLabels.about);
  command
      .option("VOLUME", given->options.volume, ".nrrd, .nhdr, .mha or .mhd with one whole number per voxel")
      .required();
  command.option("--out", given->options.out, "folder to write into: scene.json, labels.json, meshes")
      .required()
      .type_name("DIR");
  command
      .option("--table", given->options.table,
              "JSON file that says what becomes of each label; without it one is written")
      .type_name("FILE");
  command
      .option(
          "--spacing", given->spacing,
          "mm: voxels are joined up to about this length; 0: never; auto: 96 voxels along the longest edge")
      .with_default()
      .type_name("MM");
  command.option("--cells", given->options.cells, "about how many tetrahedra, of all bodies together")
      .with_default()
      .type_name("N");
  command.option("--smooth", given->options.passes, "passes of smoothing; 0: corners of voxels")
      .with_default()
      .type_name("N");
  command.option("--unit", given->unit, "of the lengths in the file, whatever it says: um, mm, cm, m or inch")
      .type_name("UNIT");
  command.calls([=, &globals] {
    labels::Options &o = given->options;
    if (!given->unit.empty() && (o.unit = labels::unit_of(given->unit)) == 0) {
      *exit_code = fail("--unit: unknown unit of length \"" + given->unit +
                        "\"; known are um, mm, cm, dm, m and inch");
      return;
    }
    if (given->spacing != "auto") {
      if (!labels::to_number(given->spacing, o.spacing) || o.spacing < 0) {
        *exit_code =
            fail("--spacing: expected a length in mm from 0 on, or auto; found \"" + given->spacing + "\"");
        return;
      }
      o.spacing *= 1e-3;
    }
    if (o.passes > 1000 || o.cells < 1 || o.cells > 5000000) {
      *exit_code = fail(o.passes > 1000 ? "--smooth: from 0 to 1000" : "--cells: from 1 to 5000000");
      return;
    }
    *exit_code = from_labels(globals, o);
  });

  Command phantom_command = mesh.command(kPhantom.name, kPhantom.about);
  phantom_command.option("KIND", given->kind, "abdomen, or nodule: a block of gel with a ball in it")
      .required();
  phantom_command.option("--out", given->out, "file to write, .nrrd").required().type_name("FILE");
  phantom_command.option("--voxel", given->voxel, "edge of a voxel, mm").with_default().type_name("MM");
  phantom_command.calls(
      [=, &globals] { *exit_code = phantom(globals, given->kind, given->voxel, given->out); });
}

}  // namespace
}  // namespace cli

int main(int argc, char **argv) { return cli::command_line(argc, argv, cli::add_commands); }
