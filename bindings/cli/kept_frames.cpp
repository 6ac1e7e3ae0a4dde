#ifdef DEFORM_HAVE_RENDER
#include "kept_frames.h"

#include <algorithm>
#include <cstdio>
#include <type_traits>

namespace cli {
namespace {

// A surface beside its arrays.
struct Row {
  uint32_t n, ntri;
  float rgb[3], through;
  bool valued, same_triangles;
};

// The rest of a frame.
struct Head {
  double t, top, up[3];
  render::Camera camera;
  render::Bounds extent;
  render::ColorMap map;
  uint64_t surfaces;
};

}  // namespace

KeptFrames::KeptFrames(const std::string &folder) : path_(folder + "/frames.kept"), file_(new_file(path_)) {
  std::remove(path_.c_str());
}

template <class T>
void KeptFrames::put(const T *from, size_t n) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (n > 0 && std::fwrite(from, sizeof(T), n, file_.get()) != n) cannot_write(path_);
}

template <class T>
void KeptFrames::get(T *to, size_t n) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (n > 0 && std::fread(to, sizeof(T), n, file_.get()) != n) cannot_write(path_);
}

template <class T>
void KeptFrames::put(const std::vector<T> &from) {
  const uint64_t n = from.size();
  put(&n, 1);
  put(from.data(), n);
}

template <class T>
void KeptFrames::get(std::vector<T> &to) {
  uint64_t n = 0;
  get(&n, 1);
  to.resize(n);
  get(to.data(), n);
}

void KeptFrames::add(const KeptFrame &frame) {
  const render::Scene &s = frame.scene;
  Head head = {};
  head.t = frame.t;
  head.top = frame.top;
  std::copy_n(s.up, 3, head.up);
  head.camera = *s.camera;
  head.extent = *s.extent;
  head.map = s.map;
  head.surfaces = s.surfaces.size();
  put(&head, 1);
  put(s.planes);
  put(s.boxes);
  put(s.spheres);
  put(s.capsules);
  last_.resize(s.surfaces.size());
  for (size_t i = 0; i < s.surfaces.size(); ++i) {
    const render::Surface &from = s.surfaces[i];
    std::vector<uint32_t> &before = last_[i].tri;
    Row row = {};
    row.n = from.n;
    row.ntri = from.ntri;
    std::copy_n(from.rgb, 3, row.rgb);
    row.through = from.through;
    row.valued = from.scalar != nullptr;
    row.same_triangles = std::equal(before.begin(), before.end(), from.tri, from.tri + 3 * size_t(from.ntri));
    put(&row, 1);
    put(from.xyz, 3 * size_t(row.n));
    if (row.valued) put(from.scalar, row.n);
    if (row.same_triangles) continue;  // most surfaces are never cut
    before.assign(from.tri, from.tri + 3 * size_t(from.ntri));
    put(before.data(), before.size());
  }
}

void KeptFrames::rewind() {
  if (std::fflush(file_.get()) != 0 || std::fseek(file_.get(), 0, SEEK_SET) != 0) cannot_write(path_);
  last_.clear();
}

bool KeptFrames::next(KeptFrame &out) {
  Head head = {};
  if (std::fread(&head, sizeof head, 1, file_.get()) != 1) return false;
  out.t = head.t;
  out.top = head.top;
  render::Scene &s = out.scene;
  s = {};
  std::copy_n(head.up, 3, s.up);
  s.camera = head.camera;
  s.extent = head.extent;
  s.map = head.map;
  get(s.planes);
  get(s.boxes);
  get(s.spheres);
  get(s.capsules);
  last_.resize(head.surfaces);
  for (Arrays &a : last_) {
    Row row = {};
    get(&row, 1);
    a.xyz.resize(3 * size_t(row.n));
    get(a.xyz.data(), a.xyz.size());
    a.scalar.resize(row.valued ? row.n : 0);
    get(a.scalar.data(), a.scalar.size());
    if (!row.same_triangles) {
      a.tri.resize(3 * size_t(row.ntri));
      get(a.tri.data(), a.tri.size());
    }
    render::Surface &to = s.surfaces.emplace_back();
    to.xyz = a.xyz.data();
    to.n = row.n;
    to.tri = a.tri.data();
    to.ntri = row.ntri;
    std::copy_n(row.rgb, 3, to.rgb);
    to.through = row.through;
    to.scalar = row.valued ? a.scalar.data() : nullptr;
  }
  return true;
}

void KeptFrames::rescale(float by) {
  for (Arrays &a : last_)
    for (float &x : a.scalar) x *= by;
}

}  // namespace cli
#endif
