// VTU beyond the dialects of tests/data/meshes: several pieces, cell types, compression, and what is refused.
#include <gtest/gtest.h>

#include <cstring>

#include "mesh/raw_mesh.h"
#include "mesh_support.h"
#ifdef DEFORM_HAVE_ZLIB
#include <zlib.h>
#endif

using namespace dfm;

namespace {

RawMesh parse(const std::string &text) {
  return parse_raw(Memory::standard(), "a.vtu", text.data(), text.size());
}

std::string array(const std::string &type, const std::string &name, const std::string &text,
                  const std::string &more = "format=\"ascii\"") {
  return "<DataArray type=\"" + type + "\" Name=\"" + name + "\" " + more + ">" + text + "</DataArray>";
}
std::string piece(int npoint, const std::string &points, int ncell, const std::string &corners,
                  const std::string &ends, const std::string &types, const std::string &data = "") {
  return "<Piece NumberOfPoints=\"" + std::to_string(npoint) + "\" NumberOfCells=\"" + std::to_string(ncell) +
         "\"><CellData>" + data + "</CellData><Points>" +
         array("Float64", "Points", points, "NumberOfComponents=\"3\" format=\"ascii\"") +
         "</Points><Cells>" + array("Int64", "connectivity", corners) + array("Int32", "offsets", ends) +
         array("UInt8", "types", types) + "</Cells></Piece>";
}
std::string file(const std::string &content, const std::string &head = "byte_order=\"LittleEndian\"") {
  return "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" " + head + ">\n<UnstructuredGrid>\n" + content +
         "\n</UnstructuredGrid></VTKFile>\n";
}
std::string points_alone(const std::string &how, const std::string &text) {
  return "<Piece NumberOfPoints=\"1\" NumberOfCells=\"0\"><Points>" + array("Float32", "Points", text, how) +
         "</Points></Piece>";
}
const std::string kFour = "0 0 0 1 0 0 0 1 0 0 0 1";
std::string one_tet() { return piece(4, kFour, 1, "0 1 2 3", "4", "10"); }

void expect_refusal(const std::string &text, dfm_status status, const std::vector<std::string> &words) {
  test::expect_error(test::error_of([&] { parse(text); }), status, words, "a.vtu");
}

std::string base64(const std::string &bytes) {
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t bits = 0;
    for (size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? digits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}
template <class T>
std::string bytes_of(const std::vector<T> &values) {
  return {reinterpret_cast<const char *>(values.data()), values.size() * sizeof(T)};
}

}  // namespace

TEST(ReadVtu, Pieces_FollowOneAnother) {
  const RawMesh raw = parse(file(one_tet() + piece(3, "5 5 5 6 5 5 5 6 5", 1, "0 1 2", "3", "5") +
                                 "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>"));
  EXPECT_EQ(raw.npoint(), 7u);
  EXPECT_EQ(raw.tets, (Array<uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(raw.tris, (Array<uint32_t>{4, 5, 6}));
}

TEST(ReadVtu, StraightFaces_AreCutIntoTriangles) {
  const std::string five = "0 0 0 1 0 0 1 1 0 0 1 0 0.5 2 0";
  const RawMesh raw = parse(file(piece(5, five, 7, "0 1 2  0 1 2 3  0 1 3 2  0 1 2 4 3  0 1 3 2  0 1  4",
                                       "3 7 11 16 20 22 23", "5 9 8 7 6 3 1")));
  EXPECT_EQ(raw.ntri(), 1u + 2 + 2 + 3 + 2);
  // a pixel's corners go row by row
  EXPECT_EQ(Array<uint32_t>(raw.tris.begin() + 9, raw.tris.begin() + 15),
            (Array<uint32_t>{0, 1, 2, 0, 2, 3}));
  // a strip's every second one is turned
  EXPECT_EQ(Array<uint32_t>(raw.tris.end() - 6, raw.tris.end()), (Array<uint32_t>{0, 1, 3, 1, 2, 3}));
}

TEST(ReadVtu, GroupsOfCells_AreKnownByTheirArray) {
  const auto groups = [](const char *name, const char *type, const char *value) {
    const RawMesh raw = parse(file(piece(4, kFour, 1, "0 1 2 3", "4", "10", array(type, name, value))));
    return raw.tet_group[0] == kNoGroup ? std::string() : raw.groups[raw.tet_group[0]].name;
  };
  EXPECT_EQ(groups("material", "Int32", "5"), "5");
  EXPECT_EQ(groups("gmsh:physical", "Int64", "-2"), "-2");
  EXPECT_EQ(groups("MaterialIds", "UInt8", "9"), "9");
  EXPECT_EQ(groups("material", "Int32", "0"), "");
  EXPECT_EQ(groups("material", "Float64", "5"), "");
  EXPECT_EQ(groups("temperature", "Int32", "5"), "");
  EXPECT_EQ(groups("a>b, it's", "Int32", "5"), "");
}

#ifdef DEFORM_HAVE_ZLIB
TEST(ReadVtu, CompressedArray_MayUnpackToSixtyFourTimesItsFile) {
  const auto packed = [](size_t npoint) {  // points that are all alike
    const std::string zeros(npoint * 12, '\0');
    uLongf size = compressBound(zeros.size());
    std::string out(size, '\0');
    compress(reinterpret_cast<Bytef *>(out.data()), &size, reinterpret_cast<const Bytef *>(zeros.data()),
             zeros.size());
    out.resize(size);
    const std::string head = bytes_of<uint32_t>({1, uint32_t(zeros.size()), 0, uint32_t(size)});
    return file("<Piece NumberOfPoints=\"" + std::to_string(npoint) + "\" NumberOfCells=\"0\"><Points>" +
                    array("Float32", "Points", base64(head) + base64(out),
                          "NumberOfComponents=\"3\" format=\"binary\"") +
                    "</Points></Piece>",
                "byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\"");
  };
  EXPECT_EQ(parse(packed(1000)).npoint(), 1000u);
  expect_refusal(packed(100000), DFM_E_FORMAT, {"cannot hold"});
}

TEST(ReadVtu, DamagedBlocks_AreRefused) {
  std::string data(16 * 10, 'x');
  for (size_t i = 0; i < data.size(); ++i) data[i] = static_cast<char>(i * 37 % 251);
  uLongf size = compressBound(data.size());
  std::string body(size, '\0');
  compress(reinterpret_cast<Bytef *>(body.data()), &size, reinterpret_cast<const Bytef *>(data.data()),
           data.size());
  body.resize(size);
  const auto with = [&](const std::vector<uint32_t> &head, const std::string &packed) {
    return file("<Piece NumberOfPoints=\"4\" NumberOfCells=\"0\"><Points>" +
                    array("UInt8", "Points", base64(bytes_of(head)) + base64(packed),
                          "NumberOfComponents=\"3\" format=\"binary\"") +
                    "</Points></Piece>",
                "byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\"");
  };
  const uint32_t n = uint32_t(data.size()), p = uint32_t(size);
  EXPECT_EQ(parse(with({1, n, 0, p}, body)).npoint(), 4u);
  std::string broken = body;
  broken[broken.size() / 2] = static_cast<char>(broken[broken.size() / 2] ^ 85);
  expect_refusal(with({1, n, 0, p}, broken), DFM_E_FORMAT, {"DataArray 'Points'", "damaged"});
  expect_refusal(with({1, n + 1, 0, p}, body), DFM_E_FORMAT, {"damaged"});
  expect_refusal(with({1, n, 0, p + 50}, body), DFM_E_FORMAT, {"block 0"});
  expect_refusal(with({1, n, n + 1, p}, body), DFM_E_FORMAT, {"cannot hold"});
  expect_refusal(with({1, 5, 0, p}, body), DFM_E_FORMAT, {"damaged"});
  expect_refusal(with({0, n, 0}, ""), DFM_E_FORMAT, {"promises 12 points"});
}
#endif

TEST(ReadVtu, DamagedText_IsRefused) {
  const auto inline_points = [](const std::string &text) {
    return file(points_alone("NumberOfComponents=\"3\" format=\"binary\"", text));
  };
  EXPECT_EQ(parse(inline_points(base64(bytes_of<uint32_t>({12, 0, 0, 0})))).npoint(), 1u);
  // length encoded apart
  const std::string apart =
      " \n" + base64(bytes_of<uint32_t>({12})) + "\n" + base64(bytes_of<uint32_t>({0, 0, 0}));
  EXPECT_EQ(parse(inline_points(apart)).npoint(), 1u);
  expect_refusal(inline_points("DAAAAA*AAAAAAAAAAAAAAA=="), DFM_E_FORMAT, {"not base64"});
  expect_refusal(inline_points(base64(bytes_of<uint32_t>({12, 0, 0, 0x7f800000}))), DFM_E_FORMAT,
                 {"DataArray 'Points', byte 8", "finite"});
  expect_refusal(inline_points(base64(bytes_of<uint32_t>({13, 0, 0, 0}))), DFM_E_FORMAT, {"13 bytes"});
}

TEST(ReadVtu, Structure_IsChecked) {
  EXPECT_EQ(parse(file(one_tet())).ntet(), 1u);
  const std::string whole = file(one_tet());
  expect_refusal(whole.substr(0, whole.find("</UnstructuredGrid>")), DFM_E_FORMAT, {"</VTKFile> is missing"});
  expect_refusal(file(""), DFM_E_FORMAT, {"no Piece"});
  expect_refusal(file(piece(4, kFour, 1, "0 1 2 4", "4", "10")), DFM_E_FORMAT,
                 {"cell 0", "point 4", "0 to 3"});
  expect_refusal(file(piece(4, kFour, 1, "0 1 2 -1", "4", "10")), DFM_E_FORMAT, {"point -1"});
  expect_refusal(file(piece(4, kFour, 1, "0 1 2 3", "5", "10")), DFM_E_FORMAT, {"5 corners of a cell"});
  expect_refusal(file(piece(4, kFour, 2, "0 1 2 3 0 1 2 3", "4 3", "10 10")), DFM_E_FORMAT,
                 {"offset of cell 1 is 3"});
  expect_refusal(file(piece(4, kFour, 2, "0 1 2 3", "4", "10")), DFM_E_FORMAT, {"2 offsets"});
  expect_refusal(file(piece(4, kFour, 1, "0 1 2", "3", "10")), DFM_E_FORMAT, {"tetrahedra", "3 points"});
  expect_refusal(file(piece(4, "0 0 0", 1, "0 1 2 3", "4", "10")), DFM_E_FORMAT, {"12 points"});
  expect_refusal(file(piece(4, "0 0 0 1 0 0 0 nan 0 0 0 1", 1, "0 1 2 3", "4", "10")), DFM_E_FORMAT,
                 {"a.vtu:3:", "'nan'"});
  expect_refusal(file(piece(8, kFour + " " + kFour, 1, "0 1 2 3 4 5 6 7", "8", "11")), DFM_E_UNSUPPORTED,
                 {"voxel", "mesh the shape"});
  expect_refusal(file(piece(4, kFour, 1, "0 1 2 3 0 1 2 3 0 1", "10", "71")), DFM_E_UNSUPPORTED,
                 {"above second order", "-order 2"});
  expect_refusal(file(points_alone("NumberOfComponents=\"2\" format=\"ascii\"", "0 0")), DFM_E_FORMAT,
                 {"2 components"});
  expect_refusal(file(points_alone("NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"", "")),
                 DFM_E_FORMAT, {"no AppendedData"});
  expect_refusal("<VTKFile type=\"ImageData\"></VTKFile>", DFM_E_UNSUPPORTED,
                 {"'ImageData'", "UnstructuredGrid or PolyData"});
  expect_refusal(file(one_tet(), "compressor=\"vtkLZ4DataCompressor\""), DFM_E_UNSUPPORTED,
                 {"LZ4", "vtkZLibDataCompressor"});
  expect_refusal(file(one_tet(), "byte_order=\"Middle\""), DFM_E_FORMAT, {"'Middle'"});
  expect_refusal(file(one_tet(), "header_type=\"UInt16\""), DFM_E_FORMAT, {"'UInt16'"});
}
