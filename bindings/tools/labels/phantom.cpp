#include "phantom.h"

#include <zlib.h>

#include <cmath>
#include <cstdio>
#include <new>

#include "label_volume.h"
#include "messages.h"

namespace labels {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kMaxVoxels = 1e8;

// A later shape replaces what it covers of earlier ones. An ellipsoid; a cylinder along z with an elliptic
// section, from end to end of the volume; or a box.
struct Shape {
  enum Kind { ellipsoid, column, box } kind;
  const char *name;
  double center[3], half[3];  // m
  int within;                 // the shape that it is cut out of; -1: none
  bool holds(const double x[3]) const {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const double q = (x[k] - center[k]) / half[k];
      if (kind == box && std::fabs(q) > 1) return false;
      if (kind != column || k < 2) sum += q * q;
    }
    return kind == box || sum <= 1;
  }
};

const Shape kAbdomen[] = {
    {Shape::column, "fat", {0, 0, 0}, {0.15, 0.105, 0.08}, -1},
    {Shape::ellipsoid, "liver", {-0.055, -0.018, 0.005}, {0.075, 0.06, 0.058}, 0},
    {Shape::ellipsoid, "lesion", {-0.06, -0.05, 0.01}, {0.016, 0.016, 0.016}, 1},
    {Shape::ellipsoid, "kidney_right", {-0.065, 0.064, -0.02}, {0.025, 0.02, 0.042}, 0},
    {Shape::ellipsoid, "kidney_left", {0.065, 0.064, -0.01}, {0.025, 0.02, 0.042}, 0},
    {Shape::column, "spine", {0, 0.062, 0}, {0.022, 0.022, 0.08}, 0},
};
const Shape kNodule[] = {
    {Shape::box, "gel", {0, 0, 0.02}, {0.05, 0.03, 0.02}, -1},
    {Shape::ellipsoid, "nodule", {0, 0, 0.026}, {0.008, 0.008, 0.008}, 0},
};

double whole_volume(const Shape &s, double height) {
  const double abc = s.half[0] * s.half[1] * s.half[2];
  if (s.kind == Shape::box) return 8 * abc;
  if (s.kind == Shape::column) return kPi * s.half[0] * s.half[1] * height;
  return 4.0 / 3.0 * kPi * abc;
}

}  // namespace

Phantom make_phantom(const std::string &kind, double voxel) {
  const bool abdomen = kind == "abdomen";
  if (!abdomen && kind != "nodule")
    throw cli::Failure(cli::kBadInput, "there is no phantom \"" + kind + "\"; there are abdomen and nodule");
  if (!(voxel > 0) || !std::isfinite(voxel))
    throw cli::Failure(cli::kBadInput, "--voxel: expected a length above 0 in millimeters");
  const Shape *shapes = abdomen ? kAbdomen : kNodule;
  const size_t n = abdomen ? std::size(kAbdomen) : std::size(kNodule);
  // The abdomen is cut off at both ends, as a scan is; elsewhere there are two voxels of air.
  double lo[3], hi[3], count = 1;
  Phantom out;
  for (int k = 0; k < 3; ++k) {
    const bool cut = abdomen && k == 2;
    const double half = shapes[0].half[k] + (cut ? 0 : 2 * voxel);
    lo[k] = shapes[0].center[k] - half;
    const double cells = cut ? std::floor(2 * half / voxel + 0.5) : std::ceil(2 * half / voxel - 1e-6);
    hi[k] = lo[k] + std::max(1.0, cells) * voxel;
    count *= std::max(1.0, cells);
    if (count > kMaxVoxels)
      throw cli::Failure(cli::kBadInput, "--voxel: this makes more than 1e8 voxels; give a larger length");
    out.volume.size[size_t(k)] = uint32_t(std::max(1.0, cells));
    out.volume.origin[k] = lo[k] + voxel / 2;
    out.volume.axis[k][k] = voxel;
  }
  out.volume.value = {0};
  out.exact.assign(n + 1, 0.0);
  for (size_t s = 0; s < n; ++s) {
    out.volume.value.push_back(int64_t(s) + 1);
    out.volume.name[int64_t(s) + 1] = shapes[s].name;
    const double own = whole_volume(shapes[s], hi[2] - lo[2]);
    out.exact[s + 1] += own;
    if (shapes[s].within >= 0) out.exact[size_t(shapes[s].within) + 1] -= own;
  }
  out.volume.voxel.reserve(out.volume.voxels());
  for (uint32_t k = 0; k < out.volume.size[2]; ++k)
    for (uint32_t j = 0; j < out.volume.size[1]; ++j)
      for (uint32_t i = 0; i < out.volume.size[0]; ++i) {
        const double c[3] = {double(i), double(j), double(k)};
        double x[3];
        for (int a = 0; a < 3; ++a) x[a] = out.volume.origin[a] + c[a] * voxel;
        uint16_t label = 0;
        for (size_t s = 0; s < n; ++s)
          if (shapes[s].holds(x)) label = uint16_t(s + 1);
        out.volume.voxel.push_back(label);
      }
  return out;
}

std::string nrrd_text(const Volume &v) {
  std::string out =
      "NRRD0005\n# made by deform mesh phantom\ntype: uint8\ndimension: 3\nspace dimension: 3\nsizes:";
  const auto vector = [](const double x[3]) {
    return cli::formatted("(%.12g,%.12g,%.12g)", 1e3 * x[0], 1e3 * x[1], 1e3 * x[2]);
  };
  for (const uint32_t n : v.size) out += " " + std::to_string(n);
  out += "\nspace directions:";
  for (const auto &axis : v.axis) out += " " + vector(axis);
  out += "\nspace units: \"mm\" \"mm\" \"mm\"\nspace origin: " + vector(v.origin) + "\nencoding: gzip\n";
  size_t segment = 0;
  for (const auto &[value, name] : v.name) {
    const std::string key = "Segment" + std::to_string(segment++);
    out += key + "_LabelValue:=" + std::to_string(value) + "\n" + key + "_Name:=" + name + "\n";
  }
  out += "\n";
  std::vector<unsigned char> bytes(v.voxels());
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<unsigned char>(v.value[v.voxel[i]]);
  z_stream z = {};
  if (deflateInit2(&z, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  std::vector<unsigned char> packed(deflateBound(&z, uLong(bytes.size())));
  z.next_in = bytes.data();
  z.avail_in = uInt(bytes.size());
  z.next_out = packed.data();
  z.avail_out = uInt(packed.size());
  deflate(&z, Z_FINISH);
  out.append(reinterpret_cast<const char *>(packed.data()), z.total_out);
  deflateEnd(&z);
  return out;
}

}  // namespace labels
