// VTU: an XML head that names arrays by their offsets, then the arrays as raw bytes, each behind its length.
#include <bit>

#include "core/file.h"
#include "mesh/cells.h"
#include "mesh/vtk.h"

namespace dfm {
namespace {

// Names as numbers of characters, each name ended by a zero, not of the type String, which meshio refuses.
std::string names_xml(const std::vector<MeshGroup> &groups) {
  const std::string n = std::to_string(groups.size());
  std::string numbers, letters;
  size_t nletter = 0;
  for (const MeshGroup &g : groups) {
    numbers += " " + std::to_string(g.dimension) + " " + std::to_string(g.tag);
    for (const char c : g.name + '\0') letters += " " + std::to_string(static_cast<unsigned char>(c));
    nletter += g.name.size() + 1;
  }
  return std::string("    <FieldData>\n      <DataArray type=\"Int32\" Name=\"") + kVtkGroupNumber +
         "\" NumberOfComponents=\"2\" NumberOfTuples=\"" + n + "\" format=\"ascii\">" + numbers +
         "</DataArray>\n      <DataArray type=\"UInt8\" Name=\"" + kVtkGroupName + "\" NumberOfTuples=\"" +
         std::to_string(nletter) + "\" format=\"ascii\">" + letters + "</DataArray>\n    </FieldData>\n";
}

std::string escaped(const char *name) {
  std::string out;
  for (; *name; ++name) {
    switch (*name) {
      case '<': out += "&lt;"; break;
      case '&': out += "&amp;"; break;
      case '"': out += "&quot;"; break;
      default: out += *name;
    }
  }
  return out;
}

struct Head {
  std::string xml;
  uint64_t offset = 0;
  void array(const char *type, const char *name, uint32_t width, uint64_t bytes) {
    xml += std::string("        <DataArray type=\"") + type + "\" Name=\"" + escaped(name) +
           "\" NumberOfComponents=\"" + std::to_string(width) + "\" format=\"appended\" offset=\"" +
           std::to_string(offset) + "\"/>\n";
    offset += sizeof(uint64_t) + bytes;
  }
  void data(const char *section, const std::vector<VtuArray> &arrays, uint32_t n) {
    xml += std::string("      <") + section + ">\n";
    for (const VtuArray &a : arrays)
      array(a.real ? "Float64" : "UInt32", a.name, a.width, uint64_t(n) * a.width * (a.real ? 8 : 4));
    xml += std::string("      </") + section + ">\n";
  }
};

void put_array(AtomicFile &out, const void *data, uint64_t bytes) {
  out.put(bytes);
  out.write(data, bytes);
}

void put_arrays(AtomicFile &out, const std::vector<VtuArray> &arrays, uint32_t n) {
  for (const VtuArray &a : arrays)
    put_array(out, a.real ? static_cast<const void *>(a.real) : a.integer,
              uint64_t(n) * a.width * (a.real ? 8 : 4));
}

}  // namespace

void write_vtu(const std::string &path, const VtuGrid &grid) {
  const uint64_t cell_corners = uint64_t(grid.ncell) * grid.corners;
  const uint64_t corners = cell_corners + 3 * uint64_t(grid.nface);
  const uint32_t ncell = grid.ncell + grid.nface;
  const bool wide = corners > INT32_MAX;  // VTK's numbers are signed
  const char *type = wide ? "Int64" : "Int32";
  const uint64_t bytes = wide ? 8 : 4;
  Head head;
  head.xml =
      std::string(
          "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"") +
      (std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian") +
      "\" header_type=\"UInt64\">\n  <UnstructuredGrid>\n";
  if (grid.groups && !grid.groups->empty()) head.xml += names_xml(*grid.groups);
  head.xml += "    <Piece NumberOfPoints=\"" + std::to_string(grid.npoint) + "\" NumberOfCells=\"" +
              std::to_string(ncell) + "\">\n";
  head.data("PointData", grid.point_data, grid.npoint);
  head.data("CellData", grid.cell_data, ncell);
  head.xml += "      <Points>\n";
  head.array("Float64", "Points", 3, uint64_t(grid.npoint) * 24);
  head.xml += "      </Points>\n      <Cells>\n";
  head.array(type, "connectivity", 1, corners * bytes);
  head.array(type, "offsets", 1, ncell * bytes);
  head.array("UInt8", "types", 1, ncell);
  head.xml += "      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_";

  AtomicFile out(path);
  out.write(head.xml);
  put_arrays(out, grid.point_data, grid.npoint);
  put_arrays(out, grid.cell_data, ncell);
  put_array(out, grid.points, uint64_t(grid.npoint) * 24);
  const auto put_number = [&](uint64_t n) { wide ? out.put(n) : out.put(uint32_t(n)); };
  out.put(corners * bytes);
  for (uint64_t i = 0; i < cell_corners; ++i) put_number(grid.cells[i]);
  for (uint64_t i = 0; i < 3 * uint64_t(grid.nface); ++i) put_number(grid.faces[i]);
  out.put(ncell * bytes);
  for (uint64_t c = 1; c <= ncell; ++c)
    put_number(c <= grid.ncell ? c * grid.corners : cell_corners + 3 * (c - grid.ncell));
  out.put<uint64_t>(ncell);
  uint8_t cell = 5;
  for (const CellKind &kind : cell_kinds())
    if (kind.nodes == grid.corners) cell = kind.vtk;
  for (uint32_t c = 0; c < ncell; ++c) out.put<uint8_t>(c < grid.ncell ? cell : 5);
  out.write("\n  </AppendedData>\n</VTKFile>\n");
  out.commit();
}

}  // namespace dfm
