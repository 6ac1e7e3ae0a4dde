// Counts, quality, defects, groups and warnings of a mesh, as a table or as JSON.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <deform/plugin.h>
#include <functional>

#include "cell_volume.h"
#include "cmd_mesh.h"
#include "crossing.h"
#include "json_text.h"
#include "messages.h"

namespace cli {
namespace {

struct Defect {
  const char *key;
  uint32_t count;
};
struct Group {
  std::string name;
  uint32_t dimension = 0, count = 0;
  bool by_triangles = false;
};

// What both kinds of mesh report, under the same names.
struct Report {
  const char *kind = "";
  std::vector<std::pair<const char *, uint32_t>> counts;   // JSON key and number
  std::vector<std::pair<std::string, std::string>> lines;  // of the table
  std::vector<std::pair<const char *, double>> measures;
  double lo[3], hi[3], edge_min = 0, edge_median = 0, edge_max = 0, quality_min = 0, quality_mean = 0;
  const char *quality = "", *best = "";
  std::vector<uint32_t> histogram;
  std::vector<Defect> defects;
  std::vector<Group> groups;
  std::vector<std::string> warnings;
  std::string summary;
};

void take_common(Report &r, const dfm_mesh_info &i) {
  std::copy_n(i.lo, 3, r.lo);
  std::copy_n(i.hi, 3, r.hi);
  r.edge_min = i.edge_min;
  r.edge_median = i.edge_median;
  r.edge_max = i.edge_max;
  r.quality_min = i.quality_min;
  r.quality_mean = i.quality_mean;
  r.histogram.assign(i.quality_histogram, i.quality_histogram + 10);
  r.warnings = lines_of(i.warnings);
}

// m3, what a filled mesh has of material: its cells reach out of the surface. Negative: it was not filled.
double material_of(const dfm_mesh_info &mesh) {
  if (!mesh.share) return -1;
  double sum = 0;
  for (uint32_t t = 0; t < mesh.ntet; ++t)
    sum += mesh.share[t] * cell_volume(mesh.points, &mesh.tets[size_t{4} * t]);
  return sum;
}

// Faces that one cell alone has, [n,3] points.
std::vector<uint32_t> boundary_of(const uint32_t *tets, uint32_t ntet) {
  std::vector<std::array<uint32_t, 3>> faces;
  faces.reserve(size_t{4} * ntet);
  for (const uint32_t *t = tets; t != tets + size_t{4} * ntet; t += 4)
    for (const auto &[a, b, c] : {std::array{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}}) {
      faces.push_back({t[a], t[b], t[c]});
      std::ranges::sort(faces.back());
    }
  std::ranges::sort(faces);
  std::vector<uint32_t> out;
  for (size_t i = 0, end = 0; i < faces.size(); i = end) {
    for (end = i + 1; end < faces.size() && faces[end] == faces[i];) ++end;
    if (end == i + 1) out.insert(out.end(), faces[i].begin(), faces[i].end());
  }
  return out;
}

// A cell by itself allows explicit sub-steps of (sum of 1 / altitude^2)^-1/2 sqrt(density / Young's modulus):
// its stiffness is at most E V times that sum, the mass at each corner rho V / 4.
struct CellBound {
  uint32_t cell;
  double volume, sum, altitude;  // m3, 1/m2, m: the least
};

CellBound bound_of(const double *x, const uint32_t *t, uint32_t cell) {
  using Vec = std::array<double, 3>;
  const auto side = [&](int i, int j) {
    Vec out;
    for (size_t k = 0; k < 3; ++k) out[k] = x[size_t{3} * t[j] + k] - x[size_t{3} * t[i] + k];
    return out;
  };
  const auto cross = [](const Vec &a, const Vec &b) {
    return Vec{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto dot = [](const Vec &a, const Vec &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const double six = dot(side(0, 1), cross(side(0, 2), side(0, 3)));
  double sum = 0, most = 0;
  for (const auto &[a, b, c] : {std::array{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}}) {
    const Vec area = cross(side(a, b), side(a, c));  // twice
    sum += dot(area, area) / (six * six);
    most = std::max(most, dot(area, area) / (six * six));
  }
  return {cell, six / 6, sum, 1 / std::sqrt(most)};
}

// m, of sub-steps in units of sqrt(density / Young's modulus): the least 2 sqrt(m / k) of all points, where
// the first `absent` cells of the list have no stiffness.
double mesh_step(const std::vector<CellBound> &cells, size_t absent, const uint32_t *tets, uint32_t npoint) {
  std::vector<double> mass(npoint), stiffness(npoint);
  for (size_t n = 0; n < cells.size(); ++n)
    for (int k = 0; k < 4; ++k) {
      const uint32_t p = tets[size_t{4} * cells[n].cell + size_t(k)];
      mass[p] += cells[n].volume / 4;
      if (n >= absent) stiffness[p] += cells[n].volume * cells[n].sum;
    }
  double most = 0;
  for (uint32_t p = 0; p < npoint; ++p)
    if (mass[p] > 0) most = std::max(most, stiffness[p] / mass[p]);
  return 2 / std::sqrt(most);
}

// Which cells bound explicit sub-steps, and what they cost.
void report_steps(Report &r, const double *x, uint32_t npoint, const uint32_t *tets, uint32_t ntet) {
  std::vector<CellBound> cells;
  for (uint32_t t = 0; t < ntet; ++t) {
    const CellBound cell = bound_of(x, tets + size_t{4} * t, t);
    if (cell.volume > 0) cells.push_back(cell);
  }
  if (cells.empty()) return;
  std::ranges::stable_sort(cells, std::greater(), &CellBound::sum);
  const double all = mesh_step(cells, 0, tets, npoint);
  const double most = mesh_step(cells, (cells.size() + 99) / 100, tets, npoint);
  r.measures.emplace_back("step", all);
  r.measures.emplace_back("step_without_worst", most);
  r.lines.emplace_back(
      "explicit sub-step",
      formatted("about %.4g m sqrt(density / Young's modulus), without the worst 1 %% of cells %.4g m", all,
                most));
  for (size_t n = 0; n < std::min<size_t>(3, cells.size()); ++n) {
    const CellBound &c = cells[n];
    const uint32_t *const t = tets + size_t{4} * c.cell;
    double center[3] = {};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 4; ++i) center[k] += x[size_t{3} * t[i] + size_t(k)] / 4;
    r.lines.emplace_back("bounded by cell",
                         formatted("%u at %.4g %.4g %.4g m: least altitude %.3g m, alone %.3g m", c.cell,
                                   center[0], center[1], center[2], c.altitude, 1 / std::sqrt(c.sum)));
  }
}

void report_crossings(Report &r, const double *points, uint32_t npoint, const uint32_t *triangles,
                      uint32_t ntriangle) {
  const size_t pairs = crossing::Counter()
                           .count({{.xyz = points, .n = npoint, .tri = triangles, .ntri = ntriangle}},
                                  crossing::Touching::allowed)
                           .within;
  r.defects.push_back({"self_crossings", uint32_t(std::min<size_t>(pairs, UINT32_MAX))});
  if (pairs > 0)
    r.warnings.push_back("the surface crosses itself in " + std::to_string(pairs) +
                         (pairs == 1 ? " pair" : " pairs") +
                         " of triangles: the volume counts twice what two parts enclose, and contact with "
                         "itself begins inside; mend the mesh in the program that made it");
}

void describe_cells(const dfm_mesh_info &i, bool crossings, Report &r) {
  take_common(r, i);
  r.kind = "cells";
  r.quality = "mean ratio";
  r.best = "regular";
  r.counts = {{"points", i.npoint},
              {"tets", i.ntet},
              {"surface_triangles", i.ntriangle},
              {"edges", i.nedge},
              {"pieces", i.npiece}};
  r.measures = {{"volume", i.volume}};
  const auto count = [&](const char *name, uint32_t n) { r.lines.emplace_back(name, std::to_string(n)); };
  count("points", i.npoint);
  struct Kind {
    uint32_t cell;
    const char *name, *counted;
  };
  const char *kind = nullptr;
  for (const Kind &of : {Kind{DFM_CELL_TET10, "second-order tetrahedra", "second_order_tets"},
                         {DFM_CELL_HEX8, "hexahedra", "hexahedra"},
                         {DFM_CELL_HEX20, "hexahedra of 20 points", "hexahedra_of_20_points"},
                         {DFM_CELL_HEX27, "hexahedra of 27 points", "hexahedra_of_27_points"}}) {
    if (of.cell != i.cell) continue;
    kind = of.name;
    r.counts.push_back({of.counted, i.ncell});
    r.lines.emplace_back("cells", std::to_string(i.ncell) + " " + kind);
  }
  count("tetrahedra", i.ntet);
  count("surface triangles", i.ntriangle);
  count("edges", i.nedge);
  count("pieces", i.npiece);
  r.lines.emplace_back("volume", formatted("%.10g m3", i.volume));
  if (const double material = material_of(i); material >= 0) {
    r.measures.push_back({"material_volume", material});
    r.lines.emplace_back("of it material", formatted("%.10g m3", material));
  }
  r.defects = {{"turned", i.turned},
               {"dropped_points", i.dropped_points},
               {"dropped_cells", i.dropped_cells},
               {"flat_cells", i.flat_cells},
               {"duplicate_points", i.duplicate_points},
               {"nonmanifold_edges", i.nonmanifold_edges},
               {"overlapping_faces", i.overlapping_faces}};
  for (uint32_t k = 0; k < i.ngroup; ++k)
    r.groups.push_back({i.group_names[k], i.group_dimension[k], i.group_npoint[k], false});
  if (crossings) {
    // the others have the bound of their model
    if (!kind) report_steps(r, i.points, i.npoint, i.tets, i.ntet);
    const std::vector<uint32_t> boundary = boundary_of(i.tets, i.ntet);
    report_crossings(r, i.points, i.npoint, boundary.data(), uint32_t(boundary.size() / 3));
  }
  r.summary = std::to_string(i.npoint) + " points, " +
              (kind ? std::to_string(i.ncell) + " " + kind : std::to_string(i.ntet) + " tetrahedra") + ", " +
              std::to_string(i.ntriangle) + " surface triangles, least mean ratio " +
              formatted("%.3g", i.quality_min);
}

void describe_surface(const dfm_mesh_info &i, bool crossings, Report &r) {
  take_common(r, i);
  r.kind = "surface";
  r.quality = "quality";
  r.best = "equilateral";
  r.counts = {{"points", i.npoint}, {"triangles", i.ntriangle}, {"edges", i.nedge}, {"pieces", i.npiece}};
  r.measures = {{"area", i.area}, {"volume", i.volume}};
  const auto count = [&](const char *name, uint32_t n) { r.lines.emplace_back(name, std::to_string(n)); };
  count("points", i.npoint);
  count("triangles", i.ntriangle);
  count("edges", i.nedge);
  count("pieces", i.npiece);
  r.lines.emplace_back(
      "closed", i.closed ? "yes"
                         : "no, " + std::to_string(i.open_edges) + " open edges around " +
                               std::to_string(i.holes) + (i.holes == 1 ? " hole, " : " holes, ") +
                               std::to_string(i.nonmanifold_edges) + " edges of more than two triangles");
  r.lines.emplace_back("area", formatted("%.10g m2", i.area));
  if (i.closed) r.lines.emplace_back("volume", formatted("%.10g m3", i.volume));
  r.defects = {{"merged_points", i.duplicate_points},
               {"dropped_points", i.dropped_points},
               {"dropped_triangles", i.dropped_cells},
               {"turned", i.turned},
               {"open_edges", i.open_edges},
               {"holes", i.holes},
               {"nonmanifold_edges", i.nonmanifold_edges}};
  for (uint32_t k = 0; k < i.ngroup; ++k)
    r.groups.push_back({i.group_names[k], 2,
                        static_cast<uint32_t>(std::count(i.face_group, i.face_group + i.nface, k)), true});
  if (crossings) report_crossings(r, i.points, i.npoint, i.faces, i.nface);
  r.summary = std::to_string(i.npoint) + " points, " + std::to_string(i.ntriangle) + " triangles, " +
              (i.closed ? "closed" : std::to_string(i.holes) + " holes") + ", least quality " +
              formatted("%.3g", i.quality_min);
}

void print_json(const std::string &file, const Report &r, const std::vector<std::string> &notes) {
  std::vector<std::string> histogram, groups;
  for (const uint32_t n : r.histogram) histogram.push_back(std::to_string(n));
  for (const Group &g : r.groups)
    groups.push_back(json_object("name", quoted(g.name), "dimension", g.dimension,
                                 g.by_triangles ? "triangles" : "points", g.count));
  JsonObject out, edge, quality, defects;
  for (const Defect &d : r.defects) defects.add(d.key, d.count);
  edge.add("min", r.edge_min, "median", r.edge_median, "max", r.edge_max);
  quality.add("min", r.quality_min, "mean", r.quality_mean, "histogram", json_array(histogram));
  out.add("file", quoted(file), "kind", quoted(r.kind));
  for (const auto &[key, n] : r.counts) out.add(key, n);
  for (const auto &[key, x] : r.measures) out.add(key, x);
  out.add("lo", json_vector(r.lo), "hi", json_vector(r.hi), "edge", edge.text(), "quality", quality.text(),
          "defects", defects.text(), "groups", json_array(groups), "warnings", json_words(r.warnings));
  if (!notes.empty()) out.add("lost", json_words(notes));
  std::fputs(indented(out.text()).c_str(), stdout);
}

void print_table(const std::string &file, const Report &r) {
  constexpr uint32_t kBar = 40;
  std::printf("%s\n", shown(file).c_str());
  for (const auto &[name, value] : r.lines) std::printf("  %-17s %s\n", name.c_str(), value.c_str());
  std::printf("  box               %g %g %g to %g %g %g m\n", r.lo[0], r.lo[1], r.lo[2], r.hi[0], r.hi[1],
              r.hi[2]);
  std::printf("  edge length       %.4g to %.4g m, median %.4g\n", r.edge_min, r.edge_max, r.edge_median);
  std::printf("  %-17s least %.3g, mean %.3g (1: %s)\n", r.quality, r.quality_min, r.quality_mean, r.best);
  const uint32_t most = std::max(1u, std::ranges::max(r.histogram));
  for (size_t bin = 0; bin < r.histogram.size(); ++bin) {
    const uint32_t n = r.histogram[bin];
    // a few bad ones show, too
    const uint32_t bar = n ? std::max(1u, static_cast<uint32_t>(static_cast<uint64_t>(n) * kBar / most)) : 0;
    if (n)
      std::printf("    %.1f to %.1f      %-9u %s\n", 0.1 * double(bin), 0.1 * double(bin + 1), n,
                  std::string(bar, '#').c_str());
  }
  static const char *const kElements[4] = {"points", "lines", "triangles", "cells"};
  for (const Group &g : r.groups)
    if (g.by_triangles)
      std::printf("  group             %s (%u triangles)\n", shown(g.name).c_str(), g.count);
    else
      std::printf("  group             %s (%s, %u points)\n", shown(g.name).c_str(),
                  kElements[std::min(g.dimension, 3u)], g.count);
  for (const std::string &w : r.warnings) std::printf("  warning: %s\n", shown(w).c_str());
}

}  // namespace

std::string unit_hint(const double lo[3], const double hi[3]) {
  const double longest = std::max({hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]});
  if (longest <= 10) return "";
  return formatted(
      "it is %.3g m long: if the file is in millimeters, give its body \"pose\": {\"scale\": 0.001} "
      "in a scene, or scale=0.001 in Python",
      longest);
}

std::vector<std::string> lines_of(const char *text) {
  std::vector<std::string> out;
  for (const char *c = text; *c;) {
    const char *end = c;
    while (*end && *end != '\n') ++end;
    out.emplace_back(c, end);
    c = *end ? end + 1 : end;
  }
  return out;
}

int report_mesh(const Globals &globals, const std::string &file, const MeshSession &session, bool show,
                const std::vector<std::string> &notes) {
  Report r;
  const dfm_mesh_info mesh = session.info();
  (mesh.ntet ? describe_cells : describe_surface)(mesh, show, r);
  if (const std::string hint = unit_hint(r.lo, r.hi); show && !hint.empty()) r.warnings.push_back(hint);
  if (globals.json) {
    print_json(file, r, notes);
  } else if (show) {
    print_table(file, r);
  } else if (!globals.quiet) {
    for (const std::string &w : r.warnings) std::fprintf(stderr, "deform: warning: %s\n", shown(w).c_str());
    for (const std::string &n : notes) std::fprintf(stderr, "deform: not kept: %s\n", shown(n).c_str());
    std::printf("%s: %s\n", shown(file).c_str(), r.summary.c_str());
  }
  return kDone;
}

}  // namespace cli
