#include "label_scene.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "cell_volume.h"
#include "file.h"
#include "label_fit.h"
#include "messages.h"
#include "run_folder.h"
#include "state_file.h"
#include "system.h"

namespace labels {
namespace {

using cli::json_object;
using cli::JsonObject;
using cli::JsonValue;
using cli::number;
using cli::quoted;

constexpr double kCellsAcross = 96;  // by default the labels are at most so many voxels long
constexpr uint32_t kFewestCells = 200;
constexpr int kRefills = 2;  // until about the wanted number of cells is left
constexpr size_t kFewVoxels = 27;
constexpr size_t kNoThing = ~size_t(0);

struct Handles {
  dfm_mesh_handle surface = 0;
  dfm_mesh_handle cells = 0;
  ~Handles() {
    if (cells) dfm_mesh_destroy(cells);
    if (surface) dfm_mesh_destroy(surface);
  }
};

class Maker {
 public:
  Maker(dfm_context *context, const Options &options) : context_(context), o_(options) {}

  Report run() {
    read();
    reduce();
    surfaces_ = surfaces_of(volume_, target_, o_.passes);
    report_.restored = surfaces_.restored;
    report_.crossing = surfaces_.crossing;
    cli::make_folder(o_.out);
    cli::make_folder(o_.out + "/surfaces");
    for (size_t e = 0; e < table_.entries.size(); ++e) write_label(e);
    for (size_t t = 0; t < table_.things.size(); ++t) write_thing(t);
    if (writes_table_) cli::write_whole(o_.out + "/labels.json", table_text(table_, volume_) + "\n");
    write_scene();
    return std::move(report_);
  }

 private:
  static std::string scene_hash(const std::string &text) { return cli::hash_text(cli::hash_of(text)); }
  void warn(const std::string &sentence) { report_.warnings.push_back(sentence); }
  std::string describe(const Entry &e) const {
    return "label " + std::to_string(volume_.value[e.label]) + " (" + e.name + ")";
  }

  void read() {
    volume_ = read_labels(o_.volume, o_.unit);
    report_.size = volume_.size;
    for (const std::string &note : volume_.notes) warn(o_.volume + ": " + note);
    if (volume_.value.size() == 1)
      refuse(o_.volume, "every voxel is 0, which is the background; give a volume with labels");
    table_ =
        o_.table.empty() ? default_table(volume_, touching_labels(volume_)) : read_table(o_.table, volume_);
    for (const std::string &w : table_.warnings) warn(w);
    if (o_.table.empty())
      warn(
          "no table of labels is given: all labels got the material \"tissue\", and those that touch form "
          "one "
          "body; change " +
          o_.out + "/labels.json and give it by --table");
    const std::string own = o_.out + "/labels.json";  // the user changes it
    std::error_code absent;
    writes_table_ = !std::filesystem::exists(cli::path_of(own), absent);
    if (!writes_table_ &&
        cli::read_file(own, 64u << 20, "a table of labels") != table_text(table_, volume_) + "\n") {
      if (o_.table.empty())
        refuse(own, "a table with other entries is there already; give it by --table, or remove it");
      if (!std::filesystem::equivalent(cli::path_of(own), cli::path_of(o_.table), absent))
        warn(own + " differs and is left as it is; the scene is of " + o_.table);
    }
    const std::string scene = o_.out + "/scene.json";
    if (std::filesystem::exists(cli::path_of(scene), absent) &&
        !cli::holds(o_.out + "/summary.json", scene_hash(cli::read_file(scene, 64u << 20, "a scene"))))
      refuse(scene,
             "not what summary.json beside it says that this command has written; move what is your own to "
             "\"scene\" "
             "and \"bodies\" of the table and remove it, or give another folder with --out");
    thing_.assign(volume_.value.size(), kNoThing);
    to_label_.assign(volume_.value.size(), "free");
    to_thing_ = to_label_;
    for (const Entry &e : table_.entries) {
      thing_[e.label] = e.thing;
      to_label_[e.label] = "to_" + e.name;
      to_thing_[e.label] = "to_" + table_.things[e.thing].name;
    }
    count_.assign(volume_.value.size(), 0);
    for (uint16_t &v : volume_.voxel) {
      if (thing_[v] == kNoThing) v = 0;
      ++count_[v];
    }
    const double cell = std::fabs(volume_.cell());
    for (const size_t n : count_) target_.push_back(double(n) * cell);
    for (const Entry &e : table_.entries)
      if (count_[e.label] < kFewVoxels)
        warn(describe(e) + " has only " + std::to_string(count_[e.label]) +
             (count_[e.label] == 1 ? " voxel" : " voxels") + ", too few for its shape to be known");
  }

  // Crops, joins voxels, and takes apart what touches itself along an edge.
  void reduce() {
    volume_ = cropped(volume_);
    double step[3], longest = 0, least = INFINITY;
    for (size_t k = 0; k < 3; ++k) {
      step[k] = 0;
      for (const double x : volume_.axis[k]) step[k] += x * x;
      step[k] = std::sqrt(step[k]);
      longest = std::max(longest, step[k] * volume_.size[k]);
      least = std::min(least, step[k]);
    }
    const double spacing = o_.spacing < 0 ? longest / kCellsAcross : o_.spacing;
    for (size_t k = 0; k < 3; ++k)
      report_.factor[k] = uint32_t(std::min(std::max(1.0, std::floor(spacing / step[k] + 0.5)), 1024.0));
    if (report_.factor != std::array<uint32_t, 3>{1, 1, 1})
      volume_ = cropped(coarsened(volume_, report_.factor));
    if (volume_.voxels() > size_t(1) << 27)
      refuse(o_.volume, "%u x %u x %u voxels are left; give a larger --spacing", volume_.size[0],
             volume_.size[1], volume_.size[2]);
    inverse_ = volume_.inverse();
    std::vector<uint32_t> group;
    for (const size_t thing : thing_) group.push_back(uint32_t(thing + 1));
    repaired_ = compose(o_.volume, volume_, group);
    if (repaired_.voxels)
      warn(std::to_string(repaired_.voxels) + (repaired_.voxels == 1 ? " voxel has" : " voxels have") +
           " another label than in the file: there a label touched itself only along an edge or at a corner, "
           "which is not the surface of a solid");
    std::vector<bool> left(volume_.value.size(), false);
    for (const uint16_t v : volume_.voxel) left[v] = true;
    for (const Entry &e : table_.entries)
      if (!left[e.label])
        refuse(o_.volume,
               "%s has %zu voxels and is lost where %u x %u x %u of them are joined; give a smaller "
               "--spacing, or leave it out by \"skip\": true",
               describe(e).c_str(), count_[e.label], report_.factor[0], report_.factor[1], report_.factor[2]);
  }

  // Coordinates that read back the same, triangles in groups by what lies beyond them. to: [value.size()]
  static void write_obj(const std::string &path, const Shell &shell, const std::vector<std::string> &to) {
    std::string text = "# surface of a label; groups say what lies beyond\n";
    for (size_t i = 0; i < shell.points.size(); i += 3)
      text += "v " + number(shell.points[i]) + " " + number(shell.points[i + 1]) + " " +
              number(shell.points[i + 2]) + "\n";
    std::map<std::string, std::string> groups;
    for (size_t t = 0; t < shell.beyond.size(); ++t) {
      const uint16_t label = shell.beyond[t];
      std::string &faces = groups[label == kOutside ? "cut" : to[label]];
      faces += "f";
      for (size_t i = 0; i < 3; ++i) faces += " " + std::to_string(shell.triangles[3 * t + i] + 1);
      faces += "\n";
    }
    for (const auto &[name, faces] : groups) text += "g " + name + "\n" + faces;
    cli::write_whole(path, text);
  }

  void write_label(size_t entry) {
    const Entry &e = table_.entries[entry];
    std::vector<bool> inside(volume_.value.size(), false);
    inside[e.label] = true;
    const Shell shell = shell_of(surfaces_, inside);
    write_obj(o_.out + "/surfaces/" + e.name + ".obj", shell, to_label_);
    LabelReport r;
    r.at_border = std::ranges::find(shell.beyond, kOutside) != shell.beyond.end();
    r.value = volume_.value[e.label];
    r.name = e.name;
    r.thing = table_.things[e.thing].name;
    r.obstacle = table_.things[e.thing].obstacle;
    r.voxels = count_[e.label];
    r.changed = repaired_.of_label[e.label];
    r.voxel_volume = target_[e.label];
    r.volume = shell.volume;
    r.triangles = uint32_t(shell.beyond.size());
    report_.open_edges += shell.open_edges;
    report_.largest_change = std::max(report_.largest_change, std::fabs(r.volume / r.voxel_volume - 1));
    if (std::fabs(r.volume / r.voxel_volume - 1) > 0.02)
      warn(describe(e) + ": its surface encloses " +
           std::to_string(std::lround(100 * std::fabs(r.volume / r.voxel_volume - 1))) +
           (r.volume < r.voxel_volume ? " % less than" : " % more than") + " its voxels do" +
           (report_.factor[0] * report_.factor[1] * report_.factor[2] > 1 ? "; a smaller --spacing keeps more"
                                                                          : ""));
    if (r.at_border)
      warn(describe(e) + " reaches the border of the volume, where its surface is closed by a plane");
    report_.labels.push_back(r);
  }

  void write_thing(size_t thing) {
    const Thing &t = table_.things[thing];
    std::vector<bool> inside(volume_.value.size(), false);
    for (const size_t e : t.entries) inside[table_.entries[e].label] = true;
    const Shell shell = shell_of(surfaces_, inside);
    report_.open_edges += shell.open_edges;
    write_obj(o_.out + "/" + t.name + ".obj", shell, to_thing_);
    ThingReport r;
    r.name = t.name;
    r.obstacle = t.obstacle;
    r.points = uint32_t(shell.from.size());
    r.triangles = uint32_t(shell.beyond.size());
    for (size_t p = 2; p < shell.points.size(); p += 3) lowest_ = std::min(lowest_, shell.points[p]);
    if (!t.obstacle) fill(thing, shell, r);
    report_.things.push_back(r);
  }

  size_t thing_at(uint16_t label) const { return label == kOutside ? kNoThing : thing_[label]; }

  static double triangle_area(const Shell &shell, size_t t) {
    Vec p[3];
    for (size_t i = 0; i < 3; ++i) p[i] = at(shell.points, shell.triangles[3 * t + i]);
    const Vec n = cross(p[1] - p[0], p[2] - p[0]);
    return std::sqrt(dot(n, n)) / 2;
  }

  // A body is held where it meets an obstacle, and attached to bodies that come before it. surface: the
  // body's own, on which its scene looks for the groups. edge: m, of its cells
  void add_borders(size_t thing, const Shell &shell, const Shell &surface, double edge) {
    for (size_t other = 0; other < table_.things.size(); ++other) {
      const Thing &a = table_.things[thing], &b = table_.things[other];
      if (other == thing || a.obstacle || (!b.obstacle && other > thing)) continue;
      const auto meets = [&](uint16_t label) { return thing_at(label) == other; };
      if (std::ranges::none_of(shell.beyond, meets)) continue;
      Border border;
      border.a = a.name;
      border.b = b.name;
      border.held = b.obstacle;
      std::vector<bool> on(surface.points.size() / 3, false);
      double area = 0;
      for (size_t t = 0; t < surface.beyond.size(); ++t)
        if (meets(surface.beyond[t])) {
          ++border.triangles;
          for (size_t i = 0; i < 3; ++i) on[surface.triangles[3 * t + i]] = true;
          area += triangle_area(surface, t);
        }
      border.points = uint32_t(std::ranges::count(on, true));
      if (border.triangles == 0) {
        warn("the body " + a.name + " meets " + b.name + " on less than a face of its cells, and is not " +
             (border.held ? "held" : "attached") + " there; give it more cells");
        if (!border.held) continue;
      }
      if (!border.held) set_stiffness(border, area, edge, a, b);
      report_.borders.push_back(border);
    }
  }

  double volume_of(const Thing &t) const {
    double sum = 0;
    for (const size_t e : t.entries) sum += target_[table_.entries[e].label];
    return sum;
  }
  uint32_t cells_of(const Thing &t) const {
    if (t.cells) return t.cells;
    double all = 0;
    for (const Thing &other : table_.things)
      if (!other.obstacle) all += volume_of(other);
    return std::max(kFewestCells, uint32_t(o_.cells * volume_of(t) / all));
  }

  struct Cells {
    std::vector<double> points, share;
    std::vector<uint32_t> tets;
    Shell boundary;  // of a body whose surface it is
  };

  static Cells cells_in(const dfm_mesh_info &mesh) {
    Cells out;
    out.points.assign(mesh.points, mesh.points + 3 * size_t(mesh.npoint));
    out.tets.assign(mesh.tets, mesh.tets + 4 * size_t(mesh.ntet));
    out.share.assign(mesh.share, mesh.share + mesh.ntet);
    return out;
  }

  // Makes them cells whose boundary can be the surface; none where the body is too thin.
  static void fit(const Shell &shell, double edge, Cells &cells, ThingReport &r) {
    const Fitted made = fit_cells(shell, cells.points, cells.tets, cells.share, edge);
    cells.points = made.points;
    cells.tets = made.tets;
    cells.share.assign(made.tets.size() / 4, 1.0);
    cells.boundary.points = made.points;
    cells.boundary.triangles = made.faces;
    for (const uint32_t t : made.under) cells.boundary.beyond.push_back(shell.beyond[t]);
    r.triangles = uint32_t(made.under.size());
    r.quality_min = made.quality_min;
    r.quality_mean = made.quality_mean;
    r.farthest = made.farthest;
  }

  void fill(size_t thing, const Shell &shell, ThingReport &r) {
    const Thing &t = table_.things[thing];
    Handles h;
    const auto need = [&](dfm_status status) {
      if (status < 0) refuse(o_.volume, "the body %s: %s", t.name.c_str(), dfm_last_error());
    };
    need(dfm_mesh_create(context_, uint32_t(shell.from.size()), shell.points.data(),
                         uint32_t(shell.beyond.size()), shell.triangles.data(), &h.surface));
    Cells cells;
    dfm_mesh_info info = {};
    info.size = sizeof info;
    const uint32_t wanted = cells_of(t);
    uint32_t requested = wanted;
    for (int again = kRefills;; --again) {
      need(dfm_mesh_fill(h.surface, requested, &h.cells));
      need(dfm_mesh_get_info(h.cells, &info));
      cells = cells_in(info);
      r.quality_min = info.quality_min;
      r.quality_mean = info.quality_mean;
      if (!t.own_boundary) break;
      fit(shell, info.edge_median, cells, r);
      if (again == 0 || cells.share.size() >= 0.9 * wanted) break;
      // cells that are mostly outside have gone, fewer of each hundred the smaller they are
      requested =
          uint32_t(requested * std::pow(wanted / std::max(wanted / 8.0, double(cells.share.size())), 0.8));
      need(dfm_mesh_destroy(std::exchange(h.cells, 0)));
    }
    if (info.warnings[0]) warn("the body " + t.name + ": " + info.warnings);
    if (cells.share.empty())
      refuse(
          o_.volume,
          "the body %s is thinner than a cell, so no cells have a boundary like it; give it more cells, or "
          "leave out its \"surface\"",
          t.name.c_str());
    r.cells = uint32_t(cells.share.size());
    std::vector<double> volume(r.cells);
    for (uint32_t c = 0; c < r.cells; ++c)
      volume[c] = cells.share[c] * cli::cell_volume(cells.points.data(), &cells.tets[4 * size_t(c)]);
    const std::vector<size_t> of_cell = labels_of(t, cells.points.data(), cells.tets.data(), volume);
    for (uint32_t c = 0; c < r.cells; ++c) {
      LabelReport &label = report_.labels[of_cell[c]];
      ++label.cells;
      label.cell_volume += volume[c];
    }
    for (const size_t e : t.entries) {
      const LabelReport &l = report_.labels[e];
      const double more = l.cell_volume / l.voxel_volume - 1;
      if (l.cells > 0 && std::fabs(more) > 0.1)
        warn(describe(table_.entries[e]) + ": its cells hold " +
             std::to_string(std::lround(100 * std::fabs(more))) +
             (more < 0 ? " % less than" : " % more than") +
             " its voxels do; give more cells by --cells or in the table");
      if (l.cells == 0)
        warn(describe(table_.entries[e]) +
             " is smaller than a cell and has none; give more cells by --cells or in the table");
    }
    write_vtk(o_.out + "/" + t.name + ".vtk", t, cells, of_cell);
    add_borders(thing, shell, t.own_boundary ? cells.boundary : shell, info.edge_median);
  }

  // Places in a cell that each label of this body has, of 35; where none has one, the nearest voxel's label.
  std::map<size_t, int> votes_of(const Thing &t, const double *x, const uint32_t *tet) {
    constexpr int kParts = 4;
    std::map<uint16_t, int> found;
    for (int a = 0; a <= kParts; ++a)
      for (int b = 0; a + b <= kParts; ++b)
        for (int c = 0; a + b + c <= kParts; ++c) {
          const int parts[4] = {a, b, c, kParts - a - b - c};
          Vec p = {0, 0, 0};
          for (int i = 0; i < 4; ++i)
            for (size_t k = 0; k < 3; ++k)
              p[k] += (parts[i] + 0.25) / (kParts + 1) * x[3 * size_t(tet[i]) + k];
          ++found[label_at(p)];
        }
    std::map<size_t, int> out;
    for (const size_t e : t.entries)
      if (const auto v = found.find(table_.entries[e].label); v != found.end()) out[e] = v->second;
    if (out.empty()) out[nearest_label(t, x, tet)] = 1;
    return out;
  }

  // One label for each cell. The one with most places would take from what is thin or round: a weight for
  // each label is sought with which the cells have the volumes of the voxels.
  std::vector<size_t> labels_of(const Thing &t, const double *points, const uint32_t *tets,
                                const std::vector<double> &volume) {
    constexpr int kRounds = 60;
    std::vector<size_t> best(volume.size(), t.entries[0]);
    if (t.entries.size() == 1) return best;
    struct Vote {
      size_t entry;
      int places;
    };
    std::vector<Vote> votes;
    std::vector<size_t> first = {0};
    for (size_t c = 0; c < volume.size(); ++c) {
      for (const auto &[entry, places] : votes_of(t, points, tets + 4 * c)) votes.push_back({entry, places});
      first.push_back(votes.size());
    }
    std::map<size_t, double> weight;
    for (const size_t e : t.entries) weight[e] = 1;
    double least = INFINITY;
    for (int round = 0; round < kRounds; ++round) {
      std::vector<size_t> out(volume.size());
      std::map<size_t, double> held;
      for (size_t c = 0; c < volume.size(); ++c) {
        double most = 0;
        for (size_t v = first[c]; v < first[c + 1]; ++v)
          if (const double w = weight[votes[v].entry] * votes[v].places; w > most) {
            most = w;
            out[c] = votes[v].entry;
          }
        held[out[c]] += volume[c];
      }
      double off = 0;
      for (const size_t e : t.entries) {
        const double wanted = report_.labels[e].voxel_volume;
        off = std::max(off, std::fabs(held[e] / wanted - 1));
        weight[e] *= std::pow(std::min(std::max(wanted / std::max(held[e], 1e-300), 0.5), 2.0), 0.3);
      }
      if (off < least) {
        least = off;
        best = out;
      }
    }
    return best;
  }

  Vec index_of(const Vec &p) const {
    const Vec arm = p - Vec{volume_.origin[0], volume_.origin[1], volume_.origin[2]};
    return {dot(inverse_[0], arm), dot(inverse_[1], arm), dot(inverse_[2], arm)};
  }
  uint16_t voxel(int64_t i, int64_t j, int64_t k) const {
    if (i < 0 || j < 0 || k < 0 || i >= volume_.size[0] || j >= volume_.size[1] || k >= volume_.size[2])
      return kOutside;
    return volume_
        .voxel[size_t(i) + size_t(volume_.size[0]) * (size_t(j) + size_t(volume_.size[1]) * size_t(k))];
  }
  uint16_t label_at(const Vec &p) const {
    const Vec c = index_of(p);
    return voxel(std::lround(c[0]), std::lround(c[1]), std::lround(c[2]));
  }
  size_t nearest_label(const Thing &t, const double *x, const uint32_t *tet) const {
    Vec p = {0, 0, 0};
    for (int i = 0; i < 4; ++i)
      for (size_t k = 0; k < 3; ++k) p[k] += x[3 * size_t(tet[i]) + k] / 4;
    const Vec c = index_of(p);
    size_t best = t.entries[0];
    double least = INFINITY;
    for (int64_t reach = 1; reach <= 64 && !std::isfinite(least); reach *= 2)
      for (int64_t k = -reach; k <= reach; ++k)
        for (int64_t j = -reach; j <= reach; ++j)
          for (int64_t i = -reach; i <= reach; ++i) {
            const uint16_t l = voxel(std::lround(c[0]) + i, std::lround(c[1]) + j, std::lround(c[2]) + k);
            const double d = double(i * i + j * j + k * k);
            for (const size_t e : t.entries)
              if (table_.entries[e].label == l && d < least) {
                least = d;
                best = e;
              }
          }
    return best;
  }

  void write_vtk(const std::string &path, const Thing &t, const Cells &cells,
                 const std::vector<size_t> &of_cell) const {
    // groups: a label's cells by its entry, then the faces at neighbors
    const Shell &boundary = cells.boundary;
    std::vector<size_t> faces;
    std::map<std::string, size_t> borders;
    for (size_t f = 0; f < boundary.beyond.size(); ++f)
      if (thing_at(boundary.beyond[f]) != kNoThing) {
        faces.push_back(f);
        borders.emplace(to_thing_[boundary.beyond[f]], 0);
      }
    size_t last = table_.entries.size();
    for (auto &[name, number] : borders) number = ++last;
    const size_t ntet = cells.share.size(), nface = faces.size();
    const std::string ncell = std::to_string(ntet + nface),
                      ngroup = std::to_string(t.entries.size() + borders.size());
    std::string text =
        "# vtk DataFile Version 3.0\ncells of a body, in groups by label\nASCII\n"
        "DATASET UNSTRUCTURED_GRID\nFIELD FieldData 2\ngroup_number 2 " +
        ngroup + " int\n";
    for (const size_t e : t.entries) text += "3 " + std::to_string(e + 1) + "\n";
    for (const auto &[name, number] : borders) text += "2 " + std::to_string(number) + "\n";
    text += "group_name 1 " + ngroup + " string\n";
    for (const size_t e : t.entries) text += table_.entries[e].name + "\n";
    for (const auto &[name, number] : borders) text += name + "\n";
    text += "POINTS " + std::to_string(cells.points.size() / 3) + " double\n";
    for (size_t i = 0; i < cells.points.size(); i += 3)
      text += number(cells.points[i]) + " " + number(cells.points[i + 1]) + " " +
              number(cells.points[i + 2]) + "\n";
    text += "CELLS " + ncell + " " + std::to_string(5 * ntet + 4 * nface) + "\n";
    const auto row = [&text](const uint32_t *corner, size_t n) {
      text += std::to_string(n);
      for (size_t i = 0; i < n; ++i) text += " " + std::to_string(corner[i]);
      text += "\n";
    };
    for (size_t c = 0; c < ntet; ++c) row(&cells.tets[4 * c], 4);
    for (const size_t f : faces) row(&boundary.triangles[3 * f], 3);
    text += "CELL_TYPES " + ncell + "\n";
    for (size_t c = 0; c < ntet; ++c) text += "10\n";
    for (size_t f = 0; f < nface; ++f) text += "5\n";
    text += "CELL_DATA " + ncell + "\nSCALARS group int 1\nLOOKUP_TABLE default\n";
    for (const size_t e : of_cell) text += std::to_string(e + 1) + "\n";
    for (const size_t f : faces) text += std::to_string(borders[to_thing_[boundary.beyond[f]]]) + "\n";
    if (!t.own_boundary) {
      text += "SCALARS share double 1\nLOOKUP_TABLE default\n";
      for (const double share : cells.share) text += number(share) + "\n";
    }
    cli::write_whole(path, text);
  }

  std::string body_json(const Thing &t) const {
    JsonObject out, surface;
    if (t.own_boundary) surface.add("from", "\"boundary\"");
    else surface.add("mesh", quoted(t.name + ".obj"));
    out.add("name", quoted(t.name), "mesh", quoted(t.name + ".vtk"), "surface", surface.text());
    if (t.entries.size() == 1) out.add("material", quoted(table_.entries[t.entries[0]].material));
    else {
      JsonObject materials;
      for (const size_t e : t.entries)
        if (report_.labels[e].cells)
          materials.add(table_.entries[e].name, quoted(table_.entries[e].material));
      out.add("materials_by_group", materials.text());
    }
    if (!t.more.find("model")) out.add("model", "{\"type\": \"corotational_fem\"}");
    std::vector<std::string> attach, fix;
    for (const Border &b : report_.borders) {
      if (b.a != t.name) continue;
      const std::string group = quoted("to_" + b.b);
      if (b.triangles == 0) continue;
      if (b.held) fix.push_back(json_object("group", group));
      else
        attach.push_back(json_object("to", quoted(b.b), "group", group, "stiffness", rounded(b.stiffness),
                                     "damping", rounded(b.damping)));
    }
    add_list(out, "attach", attach, t.more);
    add_list(out, "fix", fix, t.more);
    for (const cli::JsonMember &m : t.more.members)
      if (m.name != "attach" && m.name != "fix") out.add(m.name, cli::json_text(m.value));
    return out.text();
  }

  // Ours, then those of the table.
  static void add_list(JsonObject &out, const char *key, std::vector<std::string> ours,
                       const JsonValue &more) {
    for (const JsonValue &a : more.list(key)) ours.push_back(cli::json_text(a));
    if (!ours.empty()) out.add(key, cli::json_array(ours));
  }
  static std::string rounded(double x) {
    double value = 0;
    to_number(cli::formatted("%.3g", x), value);
    return number(value);
  }

  double of_material(const std::string &name, const char *key, const char *inner, double otherwise) const {
    const JsonValue *m = table_.materials.find(name);
    const JsonValue *v = m ? m->find(key) : nullptr;
    if (v && inner) v = v->find(inner);
    double x = 0;
    return v && to_number(v->text, x) ? x : otherwise;
  }

  // As a layer of the softer of the two materials, a quarter of a cell thick.
  void set_stiffness(Border &border, double area, double edge, const Thing &a, const Thing &b) const {
    double young = INFINITY, damping = 0;
    for (const Thing *t : {&a, &b})
      for (const size_t e : t->entries) {
        const std::string &material = table_.entries[e].material;
        const double y = of_material(material, "young", nullptr, 1e4);
        if (y >= young) continue;
        young = y;
        damping = of_material(material, "damping", "stiffness", 0.0);
      }
    border.stiffness = young * area / (0.25 * edge);
    border.damping = border.stiffness * damping;
  }

  // A body and the obstacle that holds it share their border, so they do not touch.
  std::string contact_json() const {
    JsonObject out;
    std::vector<std::string> filter;
    for (const Border &b : report_.borders)
      if (b.held) filter.push_back(json_object("between", cli::json_array({quoted(b.a), quoted(b.b)})));
    const JsonValue none, *own = table_.scene.find("contact");
    if (!own) own = &none;
    add_list(out, "filter", filter, *own);
    for (const cli::JsonMember &m : own->members)
      if (m.name != "filter") out.add(m.name, cli::json_text(m.value));
    return out.text();
  }

  void write_scene() {
    std::map<std::string, std::string> rest = {{"time", "{\"duration\": 1, \"step\": 0.002}"},
                                               {"output", output_json()}};
    std::vector<std::string> obstacles, bodies;
    bool held = false;
    for (const Thing &t : table_.things) {
      if (!t.obstacle) bodies.push_back(body_json(t));
      held = held || t.obstacle || t.more.find("fix") || t.more.find("attach");
      if (t.obstacle)
        obstacles.push_back(
            json_object("name", quoted(t.name), "shape", "\"voxels\"", "mesh", quoted(t.name + ".obj")));
    }
    // A scan shows bodies under their weight already; what nothing holds falls onto a floor.
    rest["gravity"] = held ? "[0, 0, 0]" : "[0, 0, -9.81]";
    const JsonValue *own = table_.scene.find("obstacles");
    if (own)
      for (const JsonValue &o : own->items) obstacles.push_back(cli::json_text(o));
    else if (!held) {
      const double point[3] = {0, 0, lowest_};
      std::string name = "floor";
      while (std::ranges::find(table_.things, name, &Thing::name) != table_.things.end()) name += '_';
      obstacles.push_back(
          json_object("name", cli::quoted(name), "shape", "\"plane\"", "point", cli::json_vector(point)));
    }
    for (const cli::JsonMember &m : table_.scene.members)
      if (m.name != "obstacles" && m.name != "contact") rest[m.name] = cli::json_text(m.value);
    if (const std::string contact = contact_json(); contact != "{}") rest["contact"] = contact;
    JsonObject out;
    out.add("format", "\"deform-scene\"", "version", "1", "materials", cli::json_text(table_.materials),
            "bodies", cli::json_array(bodies));
    if (!obstacles.empty()) out.add("obstacles", cli::json_array(obstacles));
    for (const auto &[key, value] : rest) out.add(key, value);
    JsonValue whole;
    cli::parse_json(out.text(), whole);
    const std::string text = cli::json_lines(whole) + "\n";
    cli::write_whole(o_.out + "/scene.json", text);
    report_.scene_hash = scene_hash(text);
  }

  // Looks from the front, a little from above, at all that there is.
  std::string output_json() const {
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < surfaces_.points.size(); ++i) {
      lo[i % 3] = std::min(lo[i % 3], surfaces_.points[i]);
      hi[i % 3] = std::max(hi[i % 3], surfaces_.points[i]);
    }
    double look[3], eye[3], size = 0;
    for (int k = 0; k < 3; ++k) {
      look[k] = (lo[k] + hi[k]) / 2;
      size = std::max(size, hi[k] - lo[k]);
    }
    const double way[3] = {0.9, -1.6, 1.0};
    const double per_meter = std::pow(10, std::ceil(3 - std::log10(size)));
    const auto rounded = [&](double x) { return std::round(x * per_meter) / per_meter + 0.0; };  // not -0
    for (int k = 0; k < 3; ++k) {
      eye[k] = rounded(look[k] + way[k] * size);
      look[k] = rounded(look[k]);
    }
    return json_object("every", "0.05", "camera",
                       json_object("eye", cli::json_vector(eye), "look_at", cli::json_vector(look)), "color",
                       "\"body\"");
  }

  dfm_context *const context_;
  const Options &o_;
  Volume volume_;
  Table table_;
  std::vector<size_t> thing_;                     // of each label; kNoThing: left out
  std::vector<std::string> to_label_, to_thing_;  // of each label: the group of triangles before it
  std::vector<size_t> count_;                     // voxels per label, of the file
  std::vector<double> target_;                    // m3
  Repaired repaired_;
  Surfaces surfaces_;
  std::array<Vec, 3> inverse_;
  double lowest_ = INFINITY;
  Report report_;
  bool writes_table_ = true;
};

}  // namespace

Report make_scene(dfm_context *context, const Options &options) { return Maker(context, options).run(); }

}  // namespace labels
