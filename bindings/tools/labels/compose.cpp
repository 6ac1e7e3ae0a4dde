// Voxels that touch along an edge or at a corner alone, and what is done about them (well-composed images:
// Latecki, 3D well-composed pictures, Graphical Models and Image Processing 59, 1997).
#include <algorithm>

#include "label_surface.h"

namespace labels {
namespace {

using Cell = std::array<int64_t, 3>;

class Composer {
 public:
  Composer(Volume &volume, const std::vector<uint32_t> &group) : v_(volume), group_(group) {
    for (int k = 0; k < 3; ++k) n_[k] = v_.size[size_t(k)];
  }

  // True: nothing touches itself any more.
  bool run(Repaired &out) {
    out.of_label.assign(v_.value.size(), 0);
    std::vector<Cell> open = all_critical();
    for (int round = 0; round < kRounds && !open.empty(); ++round) {
      bool better = true;
      while (better && !open.empty()) {
        better = false;
        for (const Cell &corner : open) better |= improve(corner, out);
        open = still_critical(open);
      }
      for (const Cell &corner : open) unify(corner, out);
      open = all_critical();  // a change may have moved a place out of the list
    }
    return open.empty();
  }

 private:
  static constexpr int kRounds = 64;

  uint16_t at(int64_t i, int64_t j, int64_t k) const {
    const bool in = i >= 0 && j >= 0 && k >= 0 && i < n_[0] && j < n_[1] && k < n_[2];
    return in ? v_.voxel[size_t(i + n_[0] * (j + n_[1] * k))] : kOutside;
  }
  size_t place(const Cell &c) const { return size_t(c[0] + n_[0] * (c[1] + n_[1] * c[2])); }
  uint32_t solid(uint16_t label) const { return label == kOutside ? 0 : group_[label]; }

  // The labels of the eight voxels around a corner. Only what is neither background nor outside has a
  // surface.
  struct Around { uint16_t label[8]; };
  Around around(const Cell &corner) const {
    Around a;
    for (int b = 0; b < 8; ++b)
      a.label[b] = at(corner[0] - 1 + (b & 1), corner[1] - 1 + ((b >> 1) & 1), corner[2] - 1 + (b >> 2));
    return a;
  }

  // Ways in which the marked ones of the eight touch along an edge or at a corner alone. The three edges that
  // leave the corner in positive direction are treated with their own corners.
  static int touching(uint32_t marks) {
    static const std::array<uint8_t, 256> kTable = [] {
      std::array<uint8_t, 256> out{};
      for (uint32_t m = 0; m < 256; ++m) {
        int n = 0;
        for (int axis = 0; axis < 3; ++axis) {
          const uint32_t u = 1u << ((axis + 1) % 3), w = 1u << ((axis + 2) % 3);
          for (uint32_t side = 0; side < 2; ++side) {
            const uint32_t o = side << axis;
            const auto on = [&](uint32_t b) { return (m >> (b + o)) & 1u; };
            const bool a = on(0), b = on(u), c = on(w), d = on(u + w);
            n += (a && d && !b && !c) || (b && c && !a && !d);
          }
        }
        for (uint32_t b = 0; b < 4; ++b) {
          const uint32_t diagonal = (1u << b) | (1u << (7 - b));
          n += m == diagonal || m == (255u & ~diagonal);
        }
        out[m] = uint8_t(n);
      }
      return out;
    }();
    return kTable[marks];
  }

  int critical(const Cell &corner) const { return critical(around(corner)); }
  int critical(const Around &a) const {
    const uint16_t *l = a.label;
    if (std::all_of(l + 1, l + 8, [&](uint16_t x) { return x == l[0]; })) return 0;
    int n = 0;
    for (int b = 0; b < 8; ++b) {
      if (l[b] == 0 || l[b] == kOutside) continue;
      uint32_t of_label = 0, of_solid = 0;
      for (int c = 0; c < 8; ++c) {
        of_label |= uint32_t(l[c] == l[b]) << c;
        of_solid |= uint32_t(solid(l[c]) == solid(l[b])) << c;
      }
      // once for each label and each solid, at its first voxel
      const uint32_t before = (1u << b) - 1;
      if (!(of_label & before)) n += touching(of_label);
      if (of_solid != of_label && !(of_solid & before)) n += touching(of_solid);
    }
    return n;
  }

  std::vector<Cell> all_critical() const {
    std::vector<Cell> out;
    Cell c;
    for (c[2] = 0; c[2] <= n_[2]; ++c[2])
      for (c[1] = 0; c[1] <= n_[1]; ++c[1])
        for (c[0] = 0; c[0] <= n_[0]; ++c[0])
          if (critical(c)) out.push_back(c);
    return out;
  }
  std::vector<Cell> still_critical(const std::vector<Cell> &corners) const {
    std::vector<Cell> out;
    for (const Cell &c : corners)
      if (critical(c)) out.push_back(c);
    return out;
  }

  // Counts all corners of one voxel.
  int critical_about(const Cell &voxel) const {
    int n = 0;
    for (int b = 0; b < 8; ++b)
      n += critical(Cell{voxel[0] + (b & 1), voxel[1] + ((b >> 1) & 1), voxel[2] + (b >> 2)});
    return n;
  }
  int faces(const Cell &c) const {
    const uint16_t own = at(c[0], c[1], c[2]);
    int n = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int step = -1; step <= 1; step += 2) {
        Cell d = c;
        d[size_t(axis)] += step;
        n += at(d[0], d[1], d[2]) != own;
      }
    return n;
  }

  void change(const Cell &voxel, uint16_t label, Repaired &out) {
    uint16_t &held = v_.voxel[place(voxel)];
    ++out.voxels;
    ++out.of_label[held];
    held = label;
  }

  // The one change of a voxel around a corner that leaves the fewest places where something touches itself,
  // and of those the least area. It is made where it leaves fewer than before: so this ends.
  bool improve(const Cell &corner, Repaired &out) {
    const Around a = around(corner);
    if (!critical(a)) return false;
    Cell best{};
    uint16_t best_label = 0;
    int best_gain = 0, best_faces = 0;
    for (int b = 0; b < 8; ++b) {
      const Cell voxel = {corner[0] - 1 + (b & 1), corner[1] - 1 + ((b >> 1) & 1), corner[2] - 1 + (b >> 2)};
      if (a.label[b] == kOutside) continue;
      const int before = critical_about(voxel), faces_before = faces(voxel);
      for (int c = 0; c < 8; ++c) {
        const uint16_t label = a.label[c];
        if (label == kOutside || label == a.label[b]) continue;
        v_.voxel[place(voxel)] = label;
        const int gain = critical_about(voxel) - before, more_faces = faces(voxel) - faces_before;
        v_.voxel[place(voxel)] = a.label[b];
        if (gain > best_gain || (gain == best_gain && (gain == 0 || more_faces >= best_faces))) continue;
        best = voxel;
        best_label = label;
        best_gain = gain;
        best_faces = more_faces;
      }
    }
    if (best_gain >= 0) return false;
    change(best, best_label, out);
    return true;
  }

  // Where no single change helps: the eight voxels become what most of them are.
  void unify(const Cell &corner, Repaired &out) {
    const Around a = around(corner);
    if (!critical(a)) return;
    uint16_t most = 0;
    long votes = 0;
    for (int b = 0; b < 8; ++b) {
      const long n = std::count(a.label, a.label + 8, a.label[b]);
      if (a.label[b] == kOutside || n <= votes) continue;
      most = a.label[b];
      votes = n;
    }
    for (int b = 0; b < 8; ++b)
      if (a.label[b] != kOutside && a.label[b] != most)
        change({corner[0] - 1 + (b & 1), corner[1] - 1 + ((b >> 1) & 1), corner[2] - 1 + (b >> 2)}, most,
               out);
  }

  Volume &v_;
  const std::vector<uint32_t> &group_;
  int64_t n_[3];
};

}  // namespace

Repaired compose(const std::string &path, Volume &volume, const std::vector<uint32_t> &group) {
  Repaired out;
  if (!Composer(volume, group).run(out))
    refuse(path,
           "the labels touch themselves along edges of voxels in so many places that they enclose no "
           "solids; smooth the label map, or give a larger --spacing");
  return out;
}

namespace {

// Per axis from the first layer that has a label to behind the last one; 0 to 0 where nothing has.
void find_labels(const Volume &v, std::array<uint32_t, 3> &lo, std::array<uint32_t, 3> &hi) {
  lo = v.size;
  hi = {};
  size_t at = 0;
  for (uint32_t k = 0; k < v.size[2]; ++k)
    for (uint32_t j = 0; j < v.size[1]; ++j)
      for (uint32_t i = 0; i < v.size[0]; ++i)
        if (v.voxel[at++] != 0) {
          const uint32_t c[3] = {i, j, k};
          for (size_t a = 0; a < 3; ++a) {
            lo[a] = std::min(lo[a], c[a]);
            hi[a] = std::max(hi[a], c[a] + 1);
          }
        }
  if (hi[0] == 0) lo = {};
}

}  // namespace

// Blocks begin with the first layer of a label, so that no block of air takes layers from it. Where the
// volume ends in air, air follows; where a label reaches the end, the last block is at least half full.
Volume coarsened(const Volume &v, const std::array<uint32_t, 3> &factor) {
  Volume out;
  out.value = v.value;
  out.name = v.name;
  out.notes = v.notes;
  std::copy_n(v.origin, 3, out.origin);
  std::array<uint32_t, 3> lo, hi;
  find_labels(v, lo, hi);
  int64_t begin[3];
  for (size_t k = 0; k < 3; ++k) {
    const int64_t f = factor[k];
    begin[k] = lo[k] > 0 ? lo[k] - f : 0;
    const int64_t layers = hi[k] - begin[k];
    out.size[k] = uint32_t(
        hi[k] < v.size[k] ? (layers + f - 1) / f + 1
                          : std::max(int64_t{begin[k] < int64_t{lo[k]} ? 2 : 1}, (2 * layers + f) / (2 * f)));
    for (size_t c = 0; c < 3; ++c) {
      out.axis[k][c] = v.axis[k][c] * double(f);
      out.origin[c] += v.axis[k][c] * (double(begin[k]) + double(f - 1) / 2);
    }
  }
  out.voxel.resize(out.voxels());
  std::vector<uint32_t> votes(v.value.size(), 0);
  std::vector<uint16_t> seen;
  std::array<uint32_t, 3> o;
  size_t at = 0;
  for (o[2] = 0; o[2] < out.size[2]; ++o[2])
    for (o[1] = 0; o[1] < out.size[1]; ++o[1])
      for (o[0] = 0; o[0] < out.size[0]; ++o[0]) {
        std::array<uint32_t, 3> from, end;
        uint32_t all = 1, read = 1;
        for (size_t k = 0; k < 3; ++k) {
          const int64_t first = begin[k] + int64_t{o[k]} * factor[k], size = v.size[k];
          from[k] = uint32_t(std::clamp(first, int64_t{0}, size));
          end[k] = uint32_t(std::clamp(first + factor[k], int64_t{0}, size));
          read *= end[k] - from[k];
          all *= first >= 0 && hi[k] == v.size[k] ? end[k] - from[k] : factor[k];
        }
        votes[0] = all - read;  // beyond the volume
        if (all > read) seen.push_back(0);
        for (uint32_t k = from[2]; k < end[2]; ++k)
          for (uint32_t j = from[1]; j < end[1]; ++j)
            for (uint32_t i = from[0]; i < end[0]; ++i) {
              const uint16_t label = v.voxel[i + size_t(v.size[0]) * (j + size_t(v.size[1]) * k)];
              if (votes[label]++ == 0) seen.push_back(label);
            }
        uint16_t most = seen[0];
        for (const uint16_t s : seen)
          if (votes[s] > votes[most] || (votes[s] == votes[most] && s < most)) most = s;
        for (const uint16_t s : seen) votes[s] = 0;
        seen.clear();
        out.voxel[at++] = most;
      }
  return out;
}

Volume cropped(const Volume &v) {
  std::array<uint32_t, 3> lo, hi;
  find_labels(v, lo, hi);
  Volume out;
  out.value = v.value;
  out.name = v.name;
  out.notes = v.notes;
  std::copy_n(v.origin, 3, out.origin);
  for (size_t a = 0; a < 3; ++a) {
    if (lo[a] > 0) --lo[a];
    if (hi[a] < v.size[a]) ++hi[a];
    out.size[a] = hi[a] - lo[a];
    for (size_t c = 0; c < 3; ++c) {
      out.axis[a][c] = v.axis[a][c];
      out.origin[c] += v.axis[a][c] * lo[a];
    }
  }
  out.voxel.reserve(out.voxels());
  for (uint32_t k = lo[2]; k < hi[2]; ++k)
    for (uint32_t j = lo[1]; j < hi[1]; ++j) {
      const auto row = v.voxel.begin() + std::ptrdiff_t(size_t(v.size[0]) * (j + size_t(v.size[1]) * k));
      out.voxel.insert(out.voxel.end(), row + lo[0], row + hi[0]);
    }
  return out;
}

}  // namespace labels
