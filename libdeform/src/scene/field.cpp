// A parameter of the model for each cell, from a table: one row per tetrahedron of the mesh file, in the
// file's order, or with a column `cell` of its number from 0 in any order.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "scene/select.h"
#include "scene/table.h"

namespace dfm::scene {

std::string columns_of(uint32_t width) {
  if (width == 1) return "value";
  if (width == 3) return "x,y,z";
  std::string out = "value0";
  for (uint32_t k = 1; k < width; ++k) out += ",value" + std::to_string(k);
  return out;
}

namespace {

// Without spaces around its names.
std::string tidy(const std::string &header) {
  std::string out;
  for (char c : header)
    if (c != ' ' && c != '\t' && c != '\r') out += c;
  return out;
}

void make_unit(double *v) {
  const double norm = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (norm > 0)
    for (int k = 0; k < 3; ++k) v[k] /= norm;
}

}  // namespace

std::vector<double> read_field(const std::string &path, const FieldFile &field, const BodyMesh &mesh) {
  const std::string plain = columns_of(field.width), numbered = "cell," + plain;
  const uint32_t nfile = mesh.ntet + mesh.dropped_cells, w = field.width;
  Table table(path, plain + " or " + numbered, nfile, int(w) + 1);
  std::string header = tidy(table.first());
  if (field.width == 1 && header == field.key) header = plain;
  if (field.width == 1 && header == "cell," + field.key) header = numbered;
  if (header != plain && header != numbered) table.refuse_header();
  table.begin(header);
  const bool has_cell = header == numbered;

  std::vector<uint32_t> cell_of(nfile, UINT32_MAX);
  for (uint32_t t = 0; t < mesh.ntet; ++t) cell_of[mesh.file_cell ? mesh.file_cell[t] : t] = t;
  std::vector<uint8_t> seen(nfile, 0);
  std::vector<double> out(size_t(mesh.ntet) * w), row(size_t{w} + has_cell);
  uint32_t next = 0;
  while (table.next(row.data())) {
    const size_t line = table.line();
    const double number = has_cell ? row[0] : double(next);
    if (!has_cell && next == nfile)
      fail(DFM_E_FORMAT, "%s:%zu: more rows than the %u tetrahedra of the mesh file", path.c_str(), line,
           nfile);
    if (number < 0 || number != std::floor(number) || number >= nfile)
      fail(DFM_E_ARG, "%s:%zu: there is no cell %g; the mesh file has the tetrahedra 0 to %u", path.c_str(),
           line, number, nfile - 1);
    const uint32_t cell = uint32_t(number);
    if (seen[cell]) fail(DFM_E_ARG, "%s:%zu: cell %u has a row already", path.c_str(), line, cell);
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

}  // namespace dfm::scene
