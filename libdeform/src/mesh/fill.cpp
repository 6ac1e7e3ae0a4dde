// Fills a surface with cells: finds the lattice pitch that gives the wanted number of cells, measures the
// share of material of each cell, corrects the sum of the shares to the enclosed volume if that is more
// accurate, and raises light cells to a least share.
//
// The floor. Mass and stiffness of a cell are scaled by the same share, so a model that is linear in the
// cells keeps its step bound however small a share is: K = sum s_c K_c and M = sum s_c M_c give x.Kx <=
// max_c(lambda_c) x.Mx. The problem is contact, and springs whose weights come from all cells around: a
// corner of cells of tiny share has almost no mass, an impulse on a surfel near it throws it through its
// cell, and mass ratios are unbounded. So no cell has less than kShareFloor of the share of the fullest
// neighbor it; the mass comes from the full cells around it, so that the mass of the body is unchanged and
// its center moves by less than a cell times the moved share. Measured on examples/scenes/fill_drop.json
// (doc/concepts/filling.md): 41 sub-steps a step without a floor, 3 from 0.01 on; 0.1 leaves mass ratios of
// 60 between points and the fewest steps at the solver's cap, and makes a ball of 5,000 cells 0.8 % wider in
// its inertia.
#include <algorithm>
#include <cfloat>
#include <cmath>

#include "core/disjoint_sets.h"
#include "core/error.h"
#include "core/lists.h"
#include "mesh/fill_lattice.h"
#include "mesh/generate.h"
#include "mesh/mesh.h"

namespace dfm {
namespace {

constexpr double kShareFloor = 0.1;  // of the fullest cell around
// A layer of cells of which a part s is material bends like one of its thickness and s times the modulus, so
// 1/s^2 times too stiffly. It is reported from a factor of four on, if a tenth of the material is concerned.
constexpr double kThin = 0.5, kWarnThin = 0.1;
constexpr double kOpening = 0.1;       // openings up to this part of the closed area are filled across
constexpr double kDeviations = 4;      // sampled and summed volume agree within so many standard deviations
constexpr double kCloseEnough = 1.02;  // number of cells over the wanted one, or the reverse
constexpr double kFarOff = 1.05;
constexpr int kTries = 12;
constexpr uint64_t kBytesPerCell = 200;  // at the peak, measured at 1e6 cells

// ---- the pitch --------------------------------------------------------------------------------------------

// Cells of a lattice in any position that a body touches: density times (V + A w/2) with the cells' mean
// width w (Steiner's formula); w = 0.85 h for this lattice, by counting.
double expected_cells(const FillSurface &s, double half_pitch) {
  const double h = 2 * half_pitch;
  return 12 / (h * h * h) * (std::fabs(s.volume) + 0.425 * h * s.area);
}

double expected_half_pitch(const FillSurface &s, double cells) {
  double lo = 1e-12, hi = 1;  // box lengths
  for (int i = 0; i < 100; ++i) {
    const double middle = std::sqrt(lo * hi);
    (expected_cells(s, middle) > cells ? lo : hi) = middle;
  }
  return hi;
}

// As far as a search may go beyond the wanted number.
uint32_t most_cells(uint32_t cells) {
  return uint32_t(std::min<uint64_t>(4 * uint64_t(cells) + 1000, kMaxCells));
}

// Below it keys overflow, or the rounding of coordinates (a quarter of the touch tolerance) reaches 1/20 of
// the lattice unit.
double least_half_pitch(const FillSurface &s) { return std::max(2.0 / kLatticeReach, 80 * s.resolution); }

// Half the pitch that offers the number of cells. The count falls with the pitch to the power of 2 (all
// surface) to 3 (all inside), and 8/3 makes each try some ten times better than the last; where the count
// jumps the tries are kept between those that were too many and too few. Square roots alone, so that the
// lattice is the same on every machine. Returns the error of the count, as a ratio above 1; infinity if no
// tried lattice has so few cells.
double seek_pitch(const FillSurface &surface, uint32_t cells, Lattice &lattice) {
  const uint32_t limit = most_cells(cells);
  double fine = least_half_pitch(surface);
  double coarse = 1;
  double best_apart = HUGE_VAL;
  double next = std::clamp(expected_half_pitch(surface, cells), fine, coarse);
  Lattice trial = lattice;
  for (int tries = 0; tries < kTries && best_apart > kCloseEnough; ++tries) {
    trial.half_pitch = next;
    const FillCover covered = cover(surface, trial, limit);
    const double ratio = double(covered.kept) / cells, apart = std::max(ratio, 1 / ratio);
    if (covered.complete && apart < best_apart) {
      best_apart = apart;
      lattice = trial;
    }
    (ratio > 1 || !covered.complete ? fine : coarse) = next;
    next *= std::sqrt(std::sqrt(std::sqrt(ratio * ratio * ratio)));
    if (covered.hopeless || !(next > fine && next < coarse)) next = std::sqrt(fine * coarse);
  }
  return best_apart;
}

// A grid point in the middle of the box preserves the symmetries of a body. If the number of cells then jumps
// too far, as across a rod a few cells wide, another position is used.
Lattice choose_lattice(const FillSurface &surface, uint32_t cells) {
  Lattice symmetric, other;
  other.shift = {0.39, 0.27, 0.61};
  const double apart = seek_pitch(surface, cells, symmetric);
  const bool better = apart > kFarOff && seek_pitch(surface, cells, other) < apart;
  if (!better && apart == HUGE_VAL)
    fail(DFM_E_FORMAT,
         "about %u cells cannot fill this surface of %zu triangles, %.3g m across with an area of %.3g m2: "
         "with every lattice spacing that was tried its triangles pass through more than %u; stray corners "
         "or long thin spikes cause this: remove them, or ask for more cells",
         cells, surface.tris.size() / 3, surface.size, surface.area * surface.size * surface.size,
         most_cells(cells));
  return better ? other : symmetric;
}

// ---- the shares -------------------------------------------------------------------------------------------

struct Filling {
  explicit Filling(const Memory &memory) { use_memory(memory, keys, share, loose, tets, sites); }
  Array<Site> keys;  // cells in the order of their keys
  Array<double> share, loose;
  void add(Site key, double its_share, double its_loose) {
    keys.push_back(key);
    share.push_back(its_share);
    loose.push_back(its_loose);
  }
  Array<uint32_t> tets;
  Array<Site> sites;  // of the points
  size_t size() const { return keys.size(); }
};

double sum(const Array<double> &x) {
  double s = 0;
  for (const double v : x) s += v;
  return s;
}

// Shifts every share by the same fraction of its uncertain part until the sum is `wanted` cells, if the
// difference is within the sampling error.
bool match_volume(Filling &f, double wanted, double piece) {
  Array<double> &share = f.share;
  if (std::fabs(sum(share) - wanted) > kDeviations * 0.5 * std::sqrt(piece * sum(f.loose)) + 1e-9 * wanted)
    return false;
  for (int i = 0; i < 100; ++i) {
    double missing = wanted - sum(share), room = 0;
    const auto may_move = [&](size_t c) {
      return f.loose[c] > 0 && (missing > 0 ? share[c] < 1 : share[c] > 0);
    };
    for (size_t c = 0; c < f.size(); ++c) room += may_move(c) ? f.loose[c] : 0;
    if (std::fabs(missing) <= 1e-13 * wanted || !(room > 0)) break;
    for (size_t c = 0; c < f.size(); ++c)
      if (may_move(c)) share[c] = std::clamp(share[c] + missing / room * f.loose[c], 0.0, 1.0);
  }
  return true;
}

// Cells in order, without cells near an opening that are outside.
Filling arrange(const FillSurface &surface, const FillCover &cover, const FillShares &shares) {
  const Memory &memory = surface.memory;
  Array<uint32_t> order{memory};
  for (uint32_t i = 0; i < cover.cells.size(); ++i)
    if (cover.kind[i] != LatticeCell::outside &&
        !(shares.share[i] == 0 && cover.kind[i] == LatticeCell::mixed))
      order.push_back(i);
  std::sort(order.begin(), order.end(),
            [&](uint32_t i, uint32_t j) { return cover.cells[i] < cover.cells[j]; });
  Filling out(memory);
  for (const uint32_t i : order) out.add(unpack(cover.cells[i]), shares.share[i], shares.loose[i]);
  return out;
}

void number_points(const Memory &memory, Filling &f) {
  Array<uint64_t> sites{memory};
  sites.reserve(4 * f.size());
  for (const Site key : f.keys) {
    Site corner[4];
    corners_of(key, corner);
    for (const Site s : corner) sites.push_back(pack(s));
  }
  const Array<uint64_t> all = sites;
  sort_unique(sites);
  for (const uint64_t s : all)
    f.tets.push_back(uint32_t(std::lower_bound(sites.begin(), sites.end(), s) - sites.begin()));
  for (const uint64_t s : sites) f.sites.push_back(unpack(s));
}

// Removes pieces without material: sheets without thickness, and isolated triangles. Returns their number of
// cells.
uint32_t drop_empty_pieces(const Memory &memory, Filling &f) {
  DisjointSets pieces(memory, uint32_t(f.sites.size()));
  for (size_t i = 0; i < f.tets.size(); ++i) pieces.join(f.tets[i], f.tets[i / 4 * 4]);
  Array<double> material(f.sites.size(), 0.0, memory);
  for (size_t c = 0; c < f.size(); ++c) material[pieces.root(f.tets[4 * c])] += f.share[c];
  Filling kept(memory);
  for (size_t c = 0; c < f.size(); ++c)
    if (material[pieces.root(f.tets[4 * c])] > 0) kept.add(f.keys[c], f.share[c], f.loose[c]);
  const auto dropped = uint32_t(f.size() - kept.size());
  if (dropped) {
    number_points(memory, kept);
    f = std::move(kept);
  }
  return dropped;
}

// Cells around each point, as rows.
struct Around {
  Array<uint32_t> row, cell;
  Around(const Memory &memory, const Filling &f) : row(memory), cell(memory) {
    const auto each = [&](const auto &use) {
      for (size_t i = 0; i < f.tets.size(); ++i) use(f.tets[i], uint32_t(i / 4));
    };
    make_lists(f.sites.size(), each, row, cell);
  }
  // Cells that share a point with c, once per shared point.
  template <class Visit>
  void each(const Filling &f, size_t c, Visit &&visit) const {
    for (size_t k = 4 * c; k < 4 * c + 4; ++k)
      for (uint32_t i = row[f.tets[k]]; i < row[f.tets[k] + 1]; ++i) visit(size_t(cell[i]));
  }
};

// Raises light cells to the least share at the expense of the full cells around them (those with at least
// half of the largest share); no cell gives more than half of its share. If no cell around has material, as
// along a hair thinner than the samples, all cells of the body give. Returns the part of the material that is
// where no cell around has more than kThin of its volume in it.
double raise_to_floor(const Memory &memory, Filling &f) {
  const Around around(memory, f);
  double first = 0, second = 0;
  for (const double s : f.share) {
    first += s;
    second += s * s;
  }
  const double typical = second / first;
  const size_t n = f.size();
  Array<double> fullest(n, 0.0, memory), need = fullest, from = fullest, gift = fullest, part = fullest;
  double common = 0, thin = 0;
  for (size_t c = 0; c < n; ++c) {
    around.each(f, c, [&](size_t d) { fullest[c] = std::max(fullest[c], f.share[d]); });
    if (fullest[c] < kThin) thin += f.share[c];
    need[c] = std::max(0.0, kShareFloor * std::max(fullest[c], kShareFloor * typical) - f.share[c]);
    if (need[c] > 0 && fullest[c] < kShareFloor * typical) {
      common += need[c];
      f.share[c] += need[c];
      need[c] = 0;
    }
  }
  const auto gives = [&](size_t c, size_t d) { return d != c && f.share[d] >= 0.5 * fullest[c]; };
  for (size_t c = 0; c < n; ++c)
    if (need[c] > 0) {
      around.each(f, c, [&](size_t d) { from[c] += gives(c, d) ? f.share[d] : 0; });
      around.each(f, c, [&](size_t d) { gift[d] += gives(c, d) ? need[c] * f.share[d] / from[c] : 0; });
    }
  for (size_t c = 0; c < n; ++c)
    if (need[c] > 0) {
      part[c] = 1;
      around.each(f, c, [&](size_t d) {
        if (gives(c, d) && gift[d] > 0.5 * f.share[d])
          part[c] = std::min(part[c], 0.5 * f.share[d] / gift[d]);
      });
    }
  std::fill(gift.begin(), gift.end(), 0.0);
  for (size_t c = 0; c < n; ++c)
    if (need[c] > 0)
      around.each(f, c,
                  [&](size_t d) { gift[d] += gives(c, d) ? part[c] * need[c] * f.share[d] / from[c] : 0; });
  for (size_t c = 0; c < n; ++c) f.share[c] += part[c] * need[c] - gift[c];
  if (common > 0) {
    const double factor = first / (first + common);
    for (double &s : f.share) s *= factor;
  }
  return thin / first;
}

// ---- sentences --------------------------------------------------------------------------------------------

void refuse_unfit(const RestMesh &surface, const FillSurface &s, uint32_t cells) {
  check_cells(cells);
  if (surface.ntri() == 0) fail(DFM_E_FORMAT, "the surface has no triangles; there is nothing to fill");
  if (!(s.area > 0)) fail(DFM_E_FORMAT, "the surface has no area; there is nothing to fill");
  const double whole = s.area + s.opening_area;
  if (s.opening_area > kOpening * whole)
    fail(DFM_E_FORMAT,
         "the surface is open: %u opening%s of %.3g m2 in all, %.0f %% of the closed surface, the box of the "
         "widest with a diagonal of %.3g m (the whole surface: %.3g m); only openings of up to %.0f %% are "
         "closed automatically: close the surface, or give a mesh with tetrahedra",
         s.openings, s.openings == 1 ? "" : "s", s.opening_area * s.size * s.size,
         100 * s.opening_area / whole, s.opening_width * s.size, s.size, 100 * kOpening);
  const double needed = expected_half_pitch(s, cells), least = least_half_pitch(s);
  if (needed >= least) return;
  const double reach = s.resolution / DBL_EPSILON * s.size;
  if (80 * s.resolution > 2.0 / kLatticeReach)
    fail(DFM_E_FORMAT,
         "%u cells need a lattice spacing of %.3g m, but coordinates of up to %.3g m are rounded to %.3g m "
         "(the surface is %.3g m across); move it nearer to the origin",
         cells, 2 * needed * s.size, reach, DBL_EPSILON * reach, s.size);
  fail(DFM_E_FORMAT,
       "%u cells need a lattice spacing of %.3g m, which is too fine for a surface that is %.3g m across; "
       "its parts lie too far apart, or it has long spikes: remove them, or ask for fewer cells",
       cells, 2 * needed * s.size, s.size);
}

void warn_filling(const FillSurface &s, const Filling &f, double half_pitch, uint32_t cells,
                  bool volume_matched, double sampled, uint32_t empty, double thin, RestMesh &out) {
  const double cube = s.size * s.size * s.size, unit = kLatticeCell * half_pitch * half_pitch * half_pitch;
  if (!s.closed)
    out.warnings.push_back(
        format("the surface has %u opening%s (or triangles that face the wrong way) of %.3g m2 in all, %.2g "
               "%% of its area, the box of the widest with a diagonal of %.3g m; the filling closes them",
               s.openings, s.openings == 1 ? "" : "s", s.opening_area * s.size * s.size,
               100 * s.opening_area / (s.area + s.opening_area), s.opening_width * s.size));
  if (s.closed && !volume_matched)
    out.warnings.push_back(
        format("the triangles sum up to a volume of %.6g m3, but %.6g m3 lie inside: the surface crosses "
               "itself, and a volume enclosed twice counts once",
               s.volume * cube, sampled * unit * cube));
  if (empty)
    out.warnings.push_back(
        format("%u cells were left out: they hold a sheet or triangles that enclose nothing", empty));
  const double count = double(f.size());
  if (std::fabs(count - cells) > 0.1 * cells)
    out.warnings.push_back(
        format("%zu cells instead of %u: this is the nearest number that the lattice gives for this surface",
               f.size(), cells));
  if (thin > kWarnThin)
    out.warnings.push_back(format(
        "%.0f %% of the material is in parts thinner than half a cell, which are at least four times too "
        "stiff in bending: ask for more cells than %u, or give a mesh with tetrahedra",
        100 * thin, cells));
}

}  // namespace

RestMesh fill_surface(const RestMesh &surface, uint32_t cells) {
  const FillSurface s(surface);
  refuse_unfit(surface, s, cells);
  need_memory(kBytesPerCell * uint64_t(cells), format("filling a surface with %u cells", cells).c_str());
  const Lattice lattice = choose_lattice(s, cells);
  const double half_pitch = lattice.half_pitch, unit = kLatticeCell * half_pitch * half_pitch * half_pitch;
  const FillCover covered = cover(s, lattice, most_cells(cells));
  const FillShares shares = sample_shares(s, covered, lattice);
  Filling f = arrange(s, covered, shares);
  const double sampled = sum(f.share);
  const bool volume_matched = s.closed && s.volume > 0 && match_volume(f, s.volume / unit, shares.piece);
  number_points(s.memory, f);
  const uint32_t empty = drop_empty_pieces(s.memory, f);
  if (f.size() == 0)
    fail(DFM_E_FORMAT,
         "nothing lies inside the surface (%u triangles, %.3g m across); it should enclose a volume, its "
         "triangles counter-clockwise from outside",
         surface.ntri(), s.size);
  const double thin = raise_to_floor(s.memory, f);

  RestMesh out(s.memory);
  const double length = half_pitch * s.size;
  out.points.reserve(3 * f.sites.size());
  for (const Site site : f.sites) {
    const Vec3 p = s.middle + length * (place_of(site) - lattice.shift);
    out.points.insert(out.points.end(), {p.x, p.y, p.z});
  }
  out.tets = std::move(f.tets);
  out.share = std::move(f.share);
  out.tet_group.assign(out.ntet(), kNoGroup);
  for (uint32_t i = 0; i < out.npoint(); ++i) out.file_point.push_back(i);
  warn_filling(s, f, half_pitch, cells, volume_matched, sampled, empty, thin, out);
  return out;
}

}  // namespace dfm
