// Tube: the triangular lattice bent into an annulus, rings of equal number, each shifted by half a step
// against the last; extruded, and each prism cut in three by the lattice's three colors with layers mirrored
// in turn, as in the cylinder: nothing twists, nothing is preferred.
#include "mesh/generate.h"

namespace dfm {
namespace {

constexpr double kMaxElongated = 20;  // beyond it cells are all but flat

struct Tube { uint32_t around, across, along; };

// Tries every number of rings in the wall; what goes around in threes (the colors close), what goes along
// by both rules.
Tube choose(double inner, double outer, double length, uint32_t cells) {
  const double wall = outer - inner, round = kTwoPi * (0.5 * (inner + outer));
  struct Choice {
    Tube tube{3, 1, 1};
    double elongation = 0;
  };
  Best<Choice> best;
  for (uint32_t across = 1; across == 1 || 6.0 * across * across <= std::max(4.0 * cells, 2e5); ++across) {
    const double row = wall / across / kRow, fill = std::sqrt(round / cells * (6.0 * across * length));
    for (const double edge : {row, 0.7 * row, 1.4 * row, fill, 0.5 * (row + fill)}) {
      const uint32_t around = 3 * rounded(std::min(1e7, round / edge / 3));
      const double h = round / around;
      for (const double wanted : {cells / (6.0 * across * around), length / h}) {
        if (wanted * across * around > kMaxCells / 6) continue;
        const uint32_t along = rounded(wanted);
        const double layer = length / along;
        const double longer = std::max({h, row, layer}) / std::min({h, row, layer});
        best.offer(choice_score(longer, 6.0 * across * around * along, cells),
                   {{around, across, along}, longer});
      }
    }
  }
  const auto &[tube, elongation] = best.choice;
  check_choice("tube", best.score < HUGE_VAL ? 6.0 * tube.around * tube.across * tube.along : HUGE_VAL,
               cells);
  if (elongation > kMaxElongated) check_choice("tube", 6 * (round / wall) * (length / wall), 0);
  return tube;
}

}  // namespace

RestMesh make_tube(const Memory &memory, double inner, double outer, double length, uint32_t cells) {
  check_tube(inner, outer, length);
  check_cells(cells);
  const Tube tube = choose(inner, outer, length, cells);
  const uint32_t n = tube.around, slab = n * (tube.across + 1);
  RestMesh mesh(memory);
  for (uint32_t layer = 0; layer <= tube.along; ++layer)
    for (uint32_t k = 0; k <= tube.across; ++k)
      for (uint32_t j = 0; j < n; ++j) {
        const Vec3 p = on_annulus(inner, outer, k, tube.across, j, n);
        add_point(mesh, {p.x, p.y, length * (double(layer) / tube.along)});
      }
  // Colors go 0 1 2 along a ring; a shifted ring begins with 2, so that each triangle has all three.
  const auto color = [&](uint32_t p) { return (p % n + 2 * (p / n % 2)) % 3; };
  for (uint32_t layer = 0; layer < tube.along; ++layer)
    for (uint32_t k = 0; k < tube.across; ++k)
      for (uint32_t j = 0; j < n; ++j) {
        const uint32_t next = (j + 1) % n, row = k * n, above = row + n;
        add_prism(mesh, layer, slab, {row + j, row + next, above + (k % 2 ? next : j)}, color);
        add_prism(mesh, layer, slab, {above + j, above + next, row + (k % 2 ? j : next)}, color);
      }
  return finished(std::move(mesh));
}

}  // namespace dfm
