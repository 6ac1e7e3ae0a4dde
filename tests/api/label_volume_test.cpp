// Readers of volumes of labels (NRRD, MetaImage), the surfaces of labels, and the phantoms.
#include "labels/label_volume.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <random>
#include <set>

#include "labels/label_surface.h"
#include "labels/phantom.h"
#include "messages.h"
#include "support.h"

namespace {

using labels::Volume;

struct Type {
  const char *nrrd, *meta;
  int bytes;
  bool is_signed;
};
const Type kTypes[] = {{"int8", "MET_CHAR", 1, true},       {"uchar", "MET_UCHAR", 1, false},
                       {"short", "MET_SHORT", 2, true},     {"uint16_t", "MET_USHORT", 2, false},
                       {"int", "MET_INT", 4, true},         {"unsigned int", "MET_UINT", 4, false},
                       {"int64", "MET_LONG_LONG", 8, true}, {"uint64", "MET_ULONG_LONG", 8, false}};

const std::vector<int> kVoxels = {0, 1, 1, 0, 2, 2, 0,   1, 100, 100, 2, 0,
                                  1, 0, 0, 2, 2, 1, 100, 0, 0,   0,   1, 2};  // 4 x 3 x 2

std::string bytes_of(const std::vector<int> &voxels, int bytes, bool big) {
  std::string out;
  for (const int v : voxels)
    for (int i = 0; i < bytes; ++i) out += char((int64_t(v) >> (8 * (big ? bytes - 1 - i : i))) & 0xff);
  return out;
}

// format 15: zlib; 31: gzip
std::string packed(const std::string &bytes, int format) {
  z_stream z = {};
  EXPECT_EQ(deflateInit2(&z, 9, Z_DEFLATED, format, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&z, uLong(bytes.size())) + 32, '\0');
  z.next_in = reinterpret_cast<Bytef *>(const_cast<char *>(bytes.data()));
  z.avail_in = uInt(bytes.size());
  z.next_out = reinterpret_cast<Bytef *>(out.data());
  z.avail_out = uInt(out.size());
  EXPECT_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

std::string nrrd_header(const std::string &type, bool big, const std::string &encoding) {
  return "NRRD0005\n# a comment\ntype: " + type +
         "\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 3 2\n"
         "space directions: (0.5,0,0) (0,0,2) (0,-1.5,0)\nkinds: domain domain domain\nendian: " +
         (big ? "big" : "little") + "\nencoding: " + encoding +
         "\nspace origin: (10,-20,30.5)\nSegment0_LabelValue:=100\nSegment0_Name:=left lung\n\n";
}

std::string meta_header(const std::string &type, bool big, bool compressed,
                        const std::string &file = "LOCAL") {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = " +
         std::string(big ? "True" : "False") + "\nCompressedData = " + (compressed ? "True" : "False") +
         "\nTransformMatrix = 1 0 0 0 0 1 0 -1 0\nOffset = 10 -20 30.5\nElementSpacing = 0.5 2 1.5\n"
         "DimSize = 4 3 2\nElementType = " +
         type + "\nElementDataFile = " + file + "\n";
}

void expect_volume(const Volume &v, const std::string &what) {
  EXPECT_EQ(v.size, (std::array<uint32_t, 3>{4, 3, 2})) << what;
  EXPECT_EQ(v.value, (std::vector<int64_t>{0, 1, 2, 100})) << what;
  ASSERT_EQ(v.voxel.size(), kVoxels.size()) << what;
  for (size_t i = 0; i < kVoxels.size(); ++i) EXPECT_EQ(v.value[v.voxel[i]], kVoxels[i]) << what << " " << i;
  const double origin[3] = {0.01, -0.02, 0.0305};
  const double axis[3][3] = {{0.0005, 0, 0}, {0, 0, 0.002}, {0, -0.0015, 0}};
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(v.origin[k], origin[k], 1e-15) << what;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(v.axis[k][c], axis[k][c], 1e-15) << what;
  }
}

std::string sentence(const std::string &bytes) {
  try {
    labels::read_labels("x.nrrd", bytes, 0);
  } catch (const cli::Failure &e) {
    EXPECT_EQ(e.exit_code, cli::kBadInput);
    return e.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string &from, const std::string &to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

// Balls in each other and beside each other, on axes that are oblique, anisotropic and, if asked,
// left-handed.
Volume balls(bool left_handed) {
  Volume v;
  v.size = {26, 22, 18};
  v.value = {0, 3, 7, 9};
  const double axis[3][3] = {{1e-3, 1e-4, 0}, {-1e-4, 1e-3, 2e-4}, {0, 0, left_handed ? -2e-3 : 2e-3}};
  std::memcpy(v.axis, axis, sizeof axis);
  for (int k = 0; k < 18; ++k)
    for (int j = 0; j < 22; ++j)
      for (int i = 0; i < 26; ++i) {
        const auto within = [&](double x, double y, double z, double r) {
          return (i - x) * (i - x) + (j - y) * (j - y) + 4 * (k - z) * (k - z) < r * r;
        };
        v.voxel.push_back(within(9, 11, 9, 4.2) ? 2 : within(9, 11, 9, 8) ? 1 : within(17, 10, 8, 7) ? 3 : 0);
      }
  return v;
}

std::vector<double> volumes_of_voxels(const Volume &v) {
  std::vector<double> out(v.value.size(), 0.0);
  for (const uint16_t l : v.voxel) out[l] += std::fabs(v.cell());
  out[0] = 0;
  return out;
}

}  // namespace

TEST(LabelVolume, Nrrd_EachTypeOrderAndEncodingGivesTheSameVoxels) {
  for (const Type &t : kTypes)
    for (const bool big : {false, true})
      for (const char *encoding : {"raw", "gzip"}) {
        std::string bytes = bytes_of(kVoxels, t.bytes, big);
        if (encoding[0] == 'g') bytes = packed(bytes, 31);
        const Volume v = labels::read_labels("x.nrrd", nrrd_header(t.nrrd, big, encoding) + bytes, 0);
        expect_volume(v, std::string(t.nrrd) + " " + encoding + (big ? " big" : " little"));
        EXPECT_EQ(v.name.at(100), "left lung");
      }
}

TEST(LabelVolume, MetaImage_EachTypeOrderAndEncodingGivesTheSameVoxels) {
  for (const Type &t : kTypes)
    for (const bool big : {false, true})
      for (const bool compressed : {false, true}) {
        std::string bytes = bytes_of(kVoxels, t.bytes, big);
        if (compressed) bytes = packed(bytes, 15);
        expect_volume(labels::read_labels("x.mha", meta_header(t.meta, big, compressed) + bytes, 0),
                      std::string(t.meta) + (compressed ? " packed" : " raw") + (big ? " big" : " little"));
      }
}

TEST(LabelVolume, DetachedVoxels_LieBesideTheHeader) {
  const std::string dir = test::scratch("label_volume") + "/with a space";
  test::run({"/bin/mkdir", "-p", dir});
  test::write_file(dir + "/voxels.raw", bytes_of(kVoxels, 2, false));
  test::write_file(dir + "/voxels.raw.gz", packed(bytes_of(kVoxels, 2, false), 31));
  test::write_file(dir + "/skipped.raw", "head" + bytes_of(kVoxels, 2, false));
  const auto nhdr = [&](const std::string &encoding, const std::string &more) {
    return replaced(nrrd_header("short", false, encoding), "space origin:", more + "space origin:");
  };
  test::write_file(dir + "/a.nhdr", nhdr("raw", "data file: voxels.raw\n"));
  test::write_file(dir + "/b.nhdr", nhdr("gzip", "data file: voxels.raw.gz\n"));
  test::write_file(dir + "/c.nhdr", nhdr("raw", "byte skip: 4\ndata file: skipped.raw\n"));
  test::write_file(dir + "/d.nhdr", nhdr("raw", "byte skip: -1\ndata file: skipped.raw\n"));
  test::write_file(dir + "/e.mhd", meta_header("MET_SHORT", false, false, "voxels.raw"));
  test::write_file(dir + "/skipped.raw.gz", packed("head" + bytes_of(kVoxels, 2, false), 31));
  test::write_file(dir + "/g.nhdr", nhdr("gzip", "byte skip: 4\ndata file: skipped.raw.gz\n"));
  for (const char *name : {"/a.nhdr", "/b.nhdr", "/c.nhdr", "/d.nhdr", "/e.mhd", "/g.nhdr"})
    expect_volume(labels::read_labels(dir + name), name);
  test::write_file(dir + "/f.mhd", meta_header("MET_SHORT", false, false, "none.raw"));
  try {
    labels::read_labels(dir + "/f.mhd");
    ADD_FAILURE() << "read without its voxels";
  } catch (const cli::Failure &e) {
    EXPECT_NE(std::string(e.what()).find("none.raw"), std::string::npos) << e.what();
  }
}

TEST(LabelVolume, SpacingsUnitsAndSpaces_AreThoseOfTheFile) {
  const std::string data = bytes_of(kVoxels, 1, false);
  const std::string plain = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n";
  Volume v = labels::read_labels("x", plain + "spacings: 1 2 3\nunits: \"cm\" \"cm\" \"cm\"\n\n" + data, 0);
  EXPECT_NEAR(v.axis[2][2], 0.03, 1e-15);
  EXPECT_TRUE(v.notes.empty());
  v = labels::read_labels("x", plain + "\n" + data, 0);
  EXPECT_NEAR(v.axis[2][2], 0.001, 1e-15);
  EXPECT_EQ(v.notes.size(), 2u);  // neither a spacing nor a unit
  v = labels::read_labels("x", plain + "spacings: 1 2 3\n\n" + data, 1e-6);
  EXPECT_NEAR(v.axis[1][1], 2e-6, 1e-18);
  // left-handed: what lies at anterior y goes to posterior -y
  v = labels::read_labels("x",
                          plain +
                              "space: left-anterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
                              "space origin: (1,2,3)\n\n" +
                              data,
                          0);
  EXPECT_LT(v.cell(), 0);
  EXPECT_NEAR(v.origin[1], -0.002, 1e-15);
}

TEST(LabelVolume, WrongFile_IsRefusedInOneSentence) {
  const std::string data = bytes_of(kVoxels, 2, false), head = nrrd_header("short", false, "raw");
  const std::string zipped = nrrd_header("short", false, "gzip"),
                    meta = meta_header("MET_SHORT", false, false);
  const std::string stream = packed(data, 31);
  std::string damaged = stream;
  damaged[12] = char(damaged[12] ^ 0x55);
  std::vector<int> gray;
  for (int i = 0; i < 2000; ++i) gray.push_back(i);
  const std::string many = replaced(head, "sizes: 4 3 2", "sizes: 2000 1 1") + bytes_of(gray, 2, false);
  const std::vector<std::array<std::string, 2>> cases = {
      {head + data.substr(0, 40), "end 8 bytes too early"},
      {zipped + stream.substr(0, stream.size() / 2), "bytes too early"},
      {zipped + damaged, "damaged"},
      {meta + data.substr(1), "end 1 bytes too early"},
      {replaced(head, "raw", "bzip2") + data, ":10: the voxels are stored as \"bzip2\""},
      {replaced(head, "raw", "text") + data, "encoding raw or gzip"},
      {replaced(head, "type: short", "type: float") + data, "labels are whole numbers"},
      {replaced(head, "type: short\n", "") + data, "no field \"type\""},
      {replaced(head, "endian: little\n", "") + data, "no field \"endian\""},
      {replaced(zipped, "endian: little\n", "") + stream, "no field \"endian\""},
      {replaced(head, "kinds: domain domain domain", "line skip: 4294967296") + data, "lines to skip"},
      {replaced(head, "sizes: 4 3 2", "sizes: 4 3") + data, "sizes has 2 numbers"},
      {replaced(head, "sizes: 4 3 2", "sizes: 4 3 0") + data, "axis 2 has 0 voxels"},
      {replaced(head, "sizes: 4 3 2", "sizes: 60000 60000 60000") + data, "more than 4 GiB"},
      {replaced(head, "sizes: 4 3 2", "sizes: 1000 1000 1000") + data, "too early"},
      {replaced(head, "(0,0,2)", "(0,0)") + data, "a vector has 2 numbers"},
      {replaced(head, "(0,0,2)", "(0,0,0)") + data, "spacing of axis 1 is 0"},
      {replaced(head, "(0,0,2)", "(1,0,0)") + data, "do not span a space"},
      {replaced(head, "(0,0,2)", "(0,0,x)") + data, "\"x\""},
      {many, "gray values"},
      {replaced(meta, "MET_SHORT", "MET_FLOAT") + data, "MET_FLOAT"},
      {replaced(meta, "NDims = 3", "NDims = 2") + data, "3 axes"},
      {replaced(meta, "BinaryData = True", "BinaryData = False") + data, "the voxels are text"},
      {replaced(meta, "BinaryData = True\n", "") + data, "the voxels are text"},
      {replaced(meta, "ElementDataFile = LOCAL\n", ""), "no \"ElementDataFile\""},
      {"\x1f\x8b" + data, "NIfTI"},
      {"solid x\n", "neither NRRD nor MetaImage"},
      {"", "neither NRRD nor MetaImage"}};
  for (const auto &[bytes, words] : cases) {
    const std::string reported = sentence(bytes);
    EXPECT_NE(reported.find(words), std::string::npos) << "no '" << words << "' in: " << reported;
    EXPECT_EQ(reported.find('\n'), std::string::npos) << reported;
  }
}

// The background is none of them.
TEST(LabelVolume, AsManyLabelsAsThereMayBe_AreRead) {
  std::vector<int> voxels = {0};
  for (int i = 1; i <= int(labels::kMaxLabels); ++i) voxels.push_back(i);
  const auto read = [&](const char *sizes) {
    const std::string head = replaced(nrrd_header("short", false, "raw"), "sizes: 4 3 2", sizes);
    return labels::read_labels("x", head + bytes_of(voxels, 2, false), 1e-3).value.size();
  };
  EXPECT_EQ(read("sizes: 1025 1 1"), voxels.size());
  voxels.push_back(int(labels::kMaxLabels) + 1);
  EXPECT_THROW(read("sizes: 1026 1 1"), cli::Failure);
}

TEST(LabelVolume, BytesBeyondTheVoxels_AreReported) {
  const std::string data = bytes_of(kVoxels, 2, false), more = data + "\1";
  const std::string raw = nrrd_header("short", false, "raw"), zipped = nrrd_header("short", false, "gzip");
  const auto notes = [](const std::string &bytes) { return labels::read_labels("x", bytes, 1e-3).notes; };
  for (const std::string &whole : {raw + data, zipped + packed(data, 31)}) EXPECT_TRUE(notes(whole).empty());
  for (const std::string &longer : {raw + more, zipped + packed(more, 31)}) {
    ASSERT_EQ(notes(longer).size(), 1u);
    EXPECT_NE(notes(longer)[0].find("more bytes follow"), std::string::npos) << notes(longer)[0];
  }
}

TEST(LabelVolume, EachByteCutOffAWholeFile_IsRefused) {
  const std::string whole = nrrd_header("short", true, "gzip") + packed(bytes_of(kVoxels, 2, true), 31);
  for (size_t n = 0; n + 9 < whole.size(); ++n) EXPECT_NE(sentence(whole.substr(0, n)), "") << n;
}

// Closed, without crossings, of the voxels' volumes; neighbors have the same vertices on their border.
TEST(LabelSurface, OfSeveralLabels_IsClosedAndKeepsVolumes) {
  for (const bool left : {false, true}) {
    Volume v = labels::cropped(balls(left));
    const std::vector<double> target = volumes_of_voxels(v);
    labels::compose("x", v, {0, 1, 1, 2});
    const labels::Surfaces s = labels::surfaces_of(v, target, 10);
    EXPECT_EQ(s.crossing, 0u);
    std::vector<std::set<uint32_t>> vertices(4);
    for (size_t l = 1; l < 4; ++l) {
      std::vector<bool> inside(4, false);
      inside[l] = true;
      const labels::Shell shell = labels::shell_of(s, inside);
      EXPECT_EQ(shell.open_edges, 0u);
      EXPECT_NEAR(shell.volume / target[l], 1, 1e-5) << "label " << l << (left ? ", left-handed" : "");
      vertices[l].insert(shell.from.begin(), shell.from.end());
    }
    const auto common = [&](size_t a, size_t b) {
      size_t n = 0;
      for (const uint32_t p : vertices[a]) n += vertices[b].count(p);
      return n;
    };
    EXPECT_EQ(common(1, 2), vertices[2].size());  // the inner ball lies in label 1
    EXPECT_GT(common(1, 3), 40u);
    EXPECT_EQ(common(2, 3), 0u);
  }
}

// Blocks of voxels begin with the label, whose air stays air: it is not cut where it ends before the file
// does. Where the file ends it, the last block is one that is at least half full.
TEST(LabelVolume, JoinedVoxels_KeepWhereALabelBeginsAndEnds) {
  for (const uint32_t factor : {1, 2, 3, 4})
    for (const uint32_t layers : {8, 9, 10, 11})
      for (const uint32_t air : {0, 1, 3}) {
        SCOPED_TRACE(testing::Message() << layers << " layers by " << factor << ", air " << air);
        Volume v;
        v.size = {layers + 2 * air, 8, 8};
        v.value = {0, 1};
        for (int k = 0; k < 3; ++k) v.axis[k][k] = 1;
        for (uint32_t i = 0; i < v.size[0] * 64; ++i) {
          const uint32_t x = i % v.size[0];
          v.voxel.push_back(x >= air && x < air + layers);
        }
        const Volume out = labels::cropped(labels::coarsened(labels::cropped(v), {factor, 1, 1}));
        const uint32_t first = air > 0, n = out.size[0] - 2 * first;
        for (uint32_t x = 0; x < out.size[0]; ++x) EXPECT_EQ(out.voxel[x], x >= first && x < first + n) << x;
        EXPECT_DOUBLE_EQ(out.origin[0] + (first - 0.5) * factor, air - 0.5);
        EXPECT_LE(std::fabs(double(n * factor) - layers), 0.5 * factor);
      }
  Volume thin;  // less than half a block, at the end of the file
  thin.size = {4, 1, 1};
  thin.value = {0, 1};
  for (int k = 0; k < 3; ++k) thin.axis[k][k] = 1;
  thin.voxel = {0, 0, 0, 1};
  EXPECT_EQ(labels::coarsened(thin, {4, 1, 1}).voxel, (std::vector<uint16_t>{0, 1}));
}

// Smoothing must do what it is for: normals of a ball's surface, which are axes on voxels, point outward.
TEST(LabelSurface, OfABall_IsSmooth) {
  Volume v;
  v.size = {24, 24, 24};
  v.value = {0, 1};
  for (int k = 0; k < 3; ++k) v.axis[k][k] = 1e-3;
  for (int i = 0; i < 24 * 24 * 24; ++i) {
    const double x = i % 24 - 11.5, y = i / 24 % 24 - 11.5, z = i / 576 - 11.5;
    v.voxel.push_back(x * x + y * y + z * z < 81);
  }
  const auto spread = [&](uint32_t passes) {  // m, standard deviation of the radius
    const labels::Surfaces s = labels::surfaces_of(v, volumes_of_voxels(v), passes);
    double sum = 0, squares = 0;
    for (size_t p = 0; p < s.points.size(); p += 3) {
      double r = 0;
      for (size_t k = 0; k < 3; ++k) r += (s.points[p + k] - 0.0115) * (s.points[p + k] - 0.0115);
      sum += std::sqrt(r);
      squares += r;
    }
    const double n = double(s.points.size() / 3);
    return std::sqrt(squares / n - sum * sum / (n * n));
  };
  const double rough = spread(0), smooth = spread(10);
  EXPECT_GT(rough, 3e-4);
  EXPECT_LT(smooth, 0.4 * rough);
}

// Noise touches itself along edges everywhere: what is made of it is still the boundary of solids.
// unsanitized: too slow there; shorter tests run the same code
TEST(LabelSurface, OfNoise_IsClosed) {
  std::mt19937 random(7);
  for (int round = 0; round < 6; ++round) {
    Volume v;
    v.size = {9, 8, 7};
    v.value = {0, 1, 2};
    for (int k = 0; k < 3; ++k) v.axis[k][k] = 1e-3;
    for (int i = 0; i < 9 * 8 * 7; ++i) v.voxel.push_back(uint16_t(random() % 3));
    labels::compose("x", v, {0, 1, 2});
    const labels::Surfaces s = labels::surfaces_of(v, volumes_of_voxels(v), 10);
    EXPECT_EQ(s.crossing, 0u);
    for (size_t l = 1; l < 3; ++l) {
      std::vector<bool> inside(3, false);
      inside[l] = true;
      EXPECT_EQ(labels::shell_of(s, inside).open_edges, 0u) << "round " << round << " label " << l;
    }
  }
}

TEST(LabelPhantom, Voxels_HaveTheVolumesOfTheShapes) {
  for (const char *kind : {"abdomen", "nodule"}) {
    const labels::Phantom p = labels::make_phantom(kind, kind[0] == 'a' ? 0.002 : 0.001);
    const Volume read = labels::read_labels("x.nrrd", labels::nrrd_text(p.volume), 0);
    EXPECT_EQ(read.value, p.volume.value);
    EXPECT_EQ(read.voxel, p.volume.voxel);
    EXPECT_EQ(read.name, p.volume.name);
    EXPECT_TRUE(read.notes.empty());
    const std::vector<double> found = volumes_of_voxels(read);
    for (size_t l = 1; l < found.size(); ++l) EXPECT_NEAR(found[l] / p.exact[l], 1, 0.02) << kind << " " << l;
  }
}
