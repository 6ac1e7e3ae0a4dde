// The tables that a scene names: boundary conditions and states by node, fields by cell, recorded hands.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/file.h"
#include "scene/rotation.h"
#include "scene/table.h"
#include "state/tool.h"

namespace dfm::scene {
namespace {

constexpr uint64_t kCellBytes = 64;  // a number of 17 digits has 24

std::string_view trim(std::string_view s) {
  while (!s.empty() && std::strchr(" \t\r", s.front())) s.remove_prefix(1);
  while (!s.empty() && std::strchr(" \t\r", s.back())) s.remove_suffix(1);
  return s;
}

// A table of about `rows` rows, read whole, with file and line in every complaint; a sentence with what was
// expected where there is none.
class Table {
 public:
  Table(std::string path, std::string expected, uint64_t rows, int columns)
      : path_(std::move(path)),
        expected_(std::move(expected)),
        bytes_(read_whole_file(Memory::standard(), path_,
                               std::max(kMiB, 2 * rows * uint64_t(columns) * kCellBytes),
                               ("a table with the header " + expected_).c_str())) {
    if (std::string_view(bytes_.data(), bytes_.size()).starts_with("\xEF\xBB\xBF")) at_ = 3;
  }
  bool empty() const { return bytes_.empty(); }

  std::string first() {  // the first line
    std::string_view line;
    return next_line(line) ? std::string(line) : "";
  }
  // Refuses the row that was read last.
  [[noreturn]] void refuse(const std::string &why, dfm_status code = DFM_E_FORMAT) const {
    fail(code, "%s:%zu: %s", path_.c_str(), line_, why.c_str());
  }
  [[noreturn]] void refuse_header() const {
    fail(DFM_E_FORMAT, "%s:1: expected the header %s", path_.c_str(), expected_.c_str());
  }
  // Rows have the columns of this header from now on.
  void begin(const std::string &header) {
    header_ = header;
    columns_ = 1 + int(std::count(header.begin(), header.end(), ','));
  }
  bool next(double *row) {  // of finite numbers; lines without any are skipped
    std::string_view text;
    do {
      if (!next_line(text)) return false;
    } while (text.empty());
    split(text, row);
    return true;
  }

 private:
  bool next_line(std::string_view &line) {
    if (at_ >= bytes_.size()) return false;
    const std::string_view rest(bytes_.data() + at_, bytes_.size() - at_);
    line = rest.substr(0, rest.find('\n'));
    at_ += line.size() + 1;
    line = trim(line);
    ++line_;
    return true;
  }
  void split(std::string_view text, double *row) const {
    int n = 0;
    for (size_t i = 0; i <= text.size(); ++n) {
      const size_t comma = std::min(text.find(',', i), text.size());
      const std::string_view cell = trim(text.substr(i, comma - i));
      i = comma + 1;
      if (n >= columns_) continue;
      const char *first = cell.data() + (!cell.empty() && cell.front() == '+');
      const auto result = std::from_chars(first, cell.data() + cell.size(), row[n]);
      if (result.ec != std::errc() || result.ptr != cell.data() + cell.size() || !std::isfinite(row[n]))
        refuse(format("expected a finite number in column %d of %s, found \"%.*s\"", n + 1, header_.c_str(),
                      int(std::min<size_t>(cell.size(), 40)), cell.data()));
    }
    if (n != columns_)
      refuse(format("expected the %d column%s %s, found %d", columns_, columns_ == 1 ? "" : "s",
                    header_.c_str(), n));
  }

  std::string path_, expected_, header_;
  Array<char> bytes_;
  size_t at_ = 0, line_ = 0;
  int columns_ = 0;
};

size_t node_of(const Table &table, double cell, size_t nodes) {
  if (cell < 0 || cell != std::floor(cell) || cell >= double(nodes))
    table.refuse(format("there is no node %g; the cells have the nodes 0 to %zu", cell, nodes - 1),
                 DFM_E_ARG);
  return size_t(cell);
}

}  // namespace

// ---- by the mesh file's node numbers from 0 ---------------------------------------------------------------

std::vector<NodalRow> read_nodal(const std::string &path, const BodyMesh &mesh) {
  const std::vector<uint32_t> point_of = points_of_nodes(mesh);
  Table table(path, kNodalHeader, point_of.size(), 7);
  if (table.empty())
    fail(DFM_E_FORMAT, "%s: nothing to read; expected the header %s and a row for each node", path.c_str(),
         kNodalHeader);
  if (table.first() != kNodalHeader) table.refuse_header();
  table.begin(kNodalHeader);
  std::vector<NodalRow> rows;
  double cell[7];
  while (table.next(cell)) {
    NodalRow row = {point_of[node_of(table, cell[0], point_of.size())], 0, {cell[4], cell[5], cell[6]}};
    for (int k = 0; k < 3; ++k) {
      if (cell[1 + k] != 0 && cell[1 + k] != 1)
        table.refuse(format("fix%c is 0 or 1, found %g", "xyz"[k], cell[1 + k]), DFM_E_ARG);
      if (cell[1 + k] == 1) row.axes = uint8_t(row.axes | (1u << k));
    }
    if (row.point == UINT32_MAX) {
      // A node without cells has no phyxel: holding it has no effect, and a force on it would be lost.
      if (cell[4] != 0 || cell[5] != 0 || cell[6] != 0)
        table.refuse(format("node %g belongs to no tetrahedron, so no force can act on it", cell[0]),
                     DFM_E_ARG);
      continue;
    }
    rows.push_back(row);
  }
  return rows;
}

std::vector<uint8_t> held_axes(const Body &body, const BodyMesh &mesh, const std::vector<NodalRow> &nodal,
                               const std::string &file) {
  std::vector<uint8_t> axes(mesh.info.npoint);
  for (const Fix &f : body.fixes)
    for (const uint32_t p : select(f.where, mesh, file)) axes[p] |= f.axes;
  for (const NodalRow &row : nodal) axes[row.point] |= row.axes;
  return axes;
}

StartState read_start_state(const std::string &path, const BodyMesh &mesh) {
  const std::vector<uint32_t> point_of = points_of_nodes(mesh);
  Table table(path, kStateHeader, point_of.size(), 7);
  if (!table.empty() && table.first() != kStateHeader) table.refuse_header();
  table.begin(kStateHeader);
  StartState out;
  out.x.resize(3 * size_t(mesh.info.npoint));
  out.v.resize(out.x.size());
  std::vector<uint8_t> seen(mesh.info.npoint, 0);
  double cell[7];
  while (table.next(cell)) {
    if (cell[0] >= double(point_of.size()) && cell[0] == std::floor(cell[0])) continue;  // of no cell
    const uint32_t point = point_of[node_of(table, cell[0], point_of.size())];
    if (point == UINT32_MAX) continue;  // as well
    if (seen[point]) table.refuse(format("node %g has a row already", cell[0]), DFM_E_ARG);
    seen[point] = 1;
    std::copy_n(cell + 1, 3, &out.x[3 * size_t(point)]);
    std::copy_n(cell + 4, 3, &out.v[3 * size_t(point)]);
  }
  const auto missing = std::find(seen.begin(), seen.end(), uint8_t(0));
  if (missing != seen.end())
    fail(DFM_E_FORMAT, "%s: node %u of the mesh file has no row", path.c_str(),
         mesh.info.file_point[size_t(missing - seen.begin())]);
  return out;
}

// ---- by cell ----------------------------------------------------------------------------------------------

// One row per tetrahedron of the mesh file, in the file's order, or with a column `cell` of its number from 0
// in any order.

std::string columns_of(uint32_t width) {
  if (width == 1) return "value";
  if (width == 3) return "x,y,z";
  std::string out = "value0";
  for (uint32_t k = 1; k < width; ++k) out += ",value" + std::to_string(k);
  return out;
}

static void make_unit(double *v) {
  const double norm = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (norm > 0)
    for (int k = 0; k < 3; ++k) v[k] /= norm;
}

std::vector<double> read_field(const std::string &path, const FieldFile &field, const BodyMesh &mesh) {
  const std::string plain = columns_of(field.width), numbered = "cell," + plain;
  const uint32_t nfile = mesh.info.ntet + mesh.info.dropped_cells, w = field.width;
  Table table(path, plain + " or " + numbered, nfile, int(w) + 1);
  std::string header = table.first();
  std::erase_if(header, [](char c) { return c == ' ' || c == '\t' || c == '\r'; });
  if (field.width == 1 && header == field.key) header = plain;
  if (field.width == 1 && header == "cell," + field.key) header = numbered;
  if (header != plain && header != numbered) table.refuse_header();
  table.begin(header);
  const bool has_cell = header == numbered;

  std::vector<uint32_t> cell_of(nfile, UINT32_MAX);
  for (uint32_t t = 0; t < mesh.info.ntet; ++t) cell_of[mesh.info.file_cell ? mesh.info.file_cell[t] : t] = t;
  std::vector<uint8_t> seen(nfile, 0);
  std::vector<double> out(size_t(mesh.info.ntet) * w), row(size_t{w} + has_cell);
  uint32_t next = 0;
  while (table.next(row.data())) {
    const double number = has_cell ? row[0] : double(next);
    if (!has_cell && next == nfile)
      table.refuse(format("more rows than the %u tetrahedra of the mesh file", nfile));
    if (number < 0 || number != std::floor(number) || number >= nfile)
      table.refuse(format("there is no cell %g; the mesh file has the tetrahedra 0 to %u", number, nfile - 1),
                   DFM_E_ARG);
    const uint32_t cell = uint32_t(number);
    if (seen[cell]) table.refuse(format("cell %u has a row already", cell), DFM_E_ARG);
    seen[cell] = 1;
    ++next;
    if (cell_of[cell] == UINT32_MAX) continue;  // a duplicate that was dropped when reading
    double *const to = &out[size_t(cell_of[cell]) * w];
    std::copy_n(&row[has_cell], w, to);
    if (field.directions) make_unit(to);
  }
  for (uint32_t c = 0; c < nfile; ++c)
    if (!seen[c] && cell_of[c] != UINT32_MAX)
      fail(DFM_E_FORMAT,
           "%s: cell %u has no row; expected one for each of the %u tetrahedra of the mesh file, found %u",
           path.c_str(), c, nfile, next);
  return out;
}

// ---- a recorded hand: the pose of a tool, and the opening of its jaws, over time --------------------------

namespace {

constexpr char kPose[] = "t,x,y,z,qx,qy,qz,qw", kOpening[] = "t,x,y,z,qx,qy,qz,qw,opening_deg";
constexpr uint64_t kMaxRows = 4000000;  // more than an hour at 1 kHz

}  // namespace

void read_hand(const std::string &path, Tool &tool) {
  Table table(path, kPose, kMaxRows, 9);
  const std::string header = table.first();
  const bool opens = header == kOpening;
  if (!opens && header != kPose)
    fail(DFM_E_FORMAT, "%s:1: expected the header %s or %s", path.c_str(), kPose, kOpening);
  table.begin(header);
  const bool jaws = has_jaws(tool.def);
  double v[9];
  while (table.next(v)) {
    if (!tool.keys.empty() && !(v[0] > tool.keys.back().t))
      table.refuse(format("times must increase, but %g s follows %g s", v[0], tool.keys.back().t));
    if (!(v[4] * v[4] + v[5] * v[5] + v[6] * v[6] + v[7] * v[7] > 0))
      table.refuse("the quaternion qx,qy,qz,qw is zero");
    tool.keys.push_back({v[0], {{v[1], v[2], v[3]}, {v[4], v[5], v[6], v[7]}}});
    if (!opens || !jaws) continue;
    if (!(v[8] >= 0 && v[8] <= kWidest))
      table.refuse(format("an opening of %g degrees; it is between 0 and %g", v[8], kWidest));
    tool.opening_keys.push_back({v[0], kRadian * v[8]});
  }
  if (tool.keys.empty()) fail(DFM_E_FORMAT, "%s: no rows below the header", path.c_str());
}

}  // namespace dfm::scene
