// A separation takes three steps that may fail: the pieces are made from the present state; the body is built
// again from the cells that stay; contacts and attachments, which the world stores by features, are mapped to
// the new features. Until then the world is unchanged; after that all is exchanged at once.
#include "cut/separate.h"

#include <algorithm>

#include "core/disjoint_sets.h"
#include "core/handle.h"
#include "cut/body_shape.h"
#include "cut/cut_ahead.h"
#include "cut/cut_lasting.h"
#include "mesh/cut_mesh.h"
#include "plugin/context.h"
#include "plugin/on_behalf.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/overlap/overlap.h"
#include "step/stages.h"
#include "step/step_impulses.h"
#include "world/change_energy.h"
#include "world/create.h"
#include "world/may_cut.h"
#include "world/measure.h"

namespace dfm {
namespace {

constexpr uint32_t kStays = kNone - 1, kGoes = kNone;

struct Parts {
  Array<uint32_t> of;           // [ncell]
  std::vector<uint32_t> cells;  // by part
  std::vector<uint32_t> to;     // by part: number of its piece, kStays or kGoes
  uint32_t n = 0, pieces = 0, heaviest = 0;
};

// Two parts with an open face between them; away2: 9 times the square of the distance of its sides now, m2.
struct Opened {
  double away2;
  uint32_t a, b;
  auto operator<=>(const Opened &) const = default;
};

std::vector<Opened> opened_between(const Body &b, const Array<uint32_t> &part) {
  std::vector<Opened> out;
  for (const uint64_t face : b.cut.open) {
    const auto [c, d] = present_cells(b, face);
    if (c == kNone || d == kNone || part[c] == part[d]) continue;
    Vec3 way;
    for (size_t i = 0; i < 4; ++i)
      for (size_t j = 0; j < 4; ++j) {
        const uint32_t p = b.tets[4 * size_t{c} + i], q = b.tets[4 * size_t{d} + j];
        if (b.cut.point[p] != b.cut.point[q]) continue;
        way += b.p.x_at(p) - b.p.x_at(q);
      }
    out.push_back({norm2(way), part[c], part[d]});
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Crumbs that stay go with the part that lies nearest to them, across open faces, one by one from the
// smallest distance on. What lies in the teeth of a part would otherwise be of another body than they are: it
// would cross them, and contact of the two whole bodies would be off until they are apart.
void lead_crumbs(const Body &b, const SeparateRule &rule, Parts &parts) {
  DisjointSets sets(b.world->memory(), parts.n);
  const auto leads = [&](uint32_t i) { return i == parts.heaviest || parts.cells[i] >= rule.least; };
  for (const Opened &face : opened_between(b, parts.of)) {
    const uint32_t i = sets.root(face.a), j = sets.root(face.b);
    if (i == j || (leads(i) && leads(j))) continue;
    if (leads(i) || (!leads(j) && i < j)) sets.of[j] = i;
    else sets.of[i] = j;
  }
  for (uint32_t i = 0; i < parts.n; ++i)
    if (leads(sets.root(i))) parts.to[i] = parts.to[sets.root(i)];
}

Parts parts_of(const Body &b, const SeparateRule &rule) {
  const Memory &m = b.world->memory();
  Parts out{Array<uint32_t>(m), {}, {}};
  const uint32_t ncell = b.ncell();
  out.of = parts_of_cells(m, b.p.n, ncell, b.tets.data(), out.n);
  out.cells.assign(out.n, 0);
  std::vector<double> mass(out.n);
  std::vector<uint8_t> weighed(b.p.n);
  for (uint32_t c = 0; c < ncell; ++c) {
    ++out.cells[out.of[c]];
    for (size_t k = 0; k < 4; ++k) {
      const uint32_t p = b.tets[size_t{4} * c + k];
      if (!std::exchange(weighed[p], uint8_t{1})) mass[out.of[c]] += b.p.mass[p];
    }
  }
  out.heaviest = uint32_t(std::max_element(mass.begin(), mass.end()) - mass.begin());
  for (uint32_t i = 0; i < out.n; ++i) {
    const bool small = out.cells[i] < rule.least;
    out.to.push_back(i == out.heaviest ? kStays : !small ? out.pieces++ : rule.removes ? kGoes : kStays);
  }
  if (!rule.removes && out.pieces > 0) lead_crumbs(b, rule, out);
  return out;
}

// Cells that a part keeps, and their open faces.
struct Share {
  CutMesh mesh;
  Array<uint64_t> open;
};
Share share_of(const Body &b, const Parts &parts, uint32_t to) {
  const Memory &m = b.world->memory();
  const uint32_t ncell = b.ncell();
  Array<uint8_t> removed(ncell, 0, m);
  for (uint32_t c = 0; c < ncell; ++c) removed[c] = parts.to[parts.of[c]] != to;
  const Array<uint64_t> none{m};
  Share out{make_cut_mesh(m, b.p.n, ncell, b.tets.data(), removed, none, b.inner), Array<uint64_t>(none)};
  std::vector<uint32_t> whole;  // ascending
  for (const uint32_t c : out.mesh.cell) whole.push_back(b.cut.whole ? b.cut.cell[c] : c);
  const auto has = [&](uint64_t cell) {
    return std::binary_search(whole.begin(), whole.end(), uint32_t(cell));
  };
  for (const uint64_t face : b.cut.open)
    if (has(face >> 32) || has(face & kNone)) out.open.push_back(face);
  return out;
}

std::string free_name(World &w, const std::string &whole, uint32_t &number) {
  for (;; ++number) {
    std::string name = whole + "." + std::to_string(number);
    if (w.find_body(name) || w.find_obstacle(name)) continue;
    ++number;
    return name;
  }
}

// Reports the cells that go.
void report_removed(const Body &b, const Parts &parts, CutReport &out) {
  std::vector<uint8_t> seen(b.p.n);
  for (size_t c = 0; c < parts.of.size(); ++c) {
    if (parts.to[parts.of[c]] != kGoes) continue;
    ++out.cells;
    for (size_t k = 0; k < 4; ++k) {
      const uint32_t p = b.tets[4 * c + k];
      if (std::exchange(seen[p], uint8_t{1})) continue;
      out.mass += b.p.mass[p];
      add3(out.momentum, b.p.mass[p] * b.p.v_at(p));
    }
  }
}

void log_small_parts(const Body &b, const SeparateRule &rule, const Parts &parts) {
  uint32_t n = 0;
  for (uint32_t i = 0; i < parts.n; ++i) n += i != parts.heaviest && parts.cells[i] < rule.least;
  if (n == 0) return;
  b.world->context->logf(DFM_LOG_INFO, "body '%s': %u %s of fewer than %u cells %s", b.name.c_str(), n,
                         n == 1 ? "part" : "parts", rule.least,
                         rule.removes ? "have been removed with their mass"
                                      : "stay with the parts next to them, and are no bodies of their own");
}

}  // namespace

void separate(Body &b, const SeparateRule &rule, CutReport &out) {
  World &w = *b.world;
  const OnBehalf prefix(b.name);
  prepare(w);
  check_may_cut(b, b.model);
  const Parts parts = parts_of(b, rule);
  out.parts = static_cast<uint32_t>(std::count(parts.to.begin(), parts.to.end(), kStays));
  if (out.parts == parts.n) {
    b.separate.waits = false;
    return;
  }

  wake(w, b);
  end_idle(w);
  const double elastic = elastic_energy(b), kinetic = kinetic_of(b);
  const HostWork work(b);
  reserve_places(w, parts.pieces);
  std::vector<Body *> pieces;
  uint32_t number = 1;
  for (uint32_t i = 0; i < parts.pieces; ++i) {
    const std::string &whole = b.piece_of ? b.whole_name : b.name;
    Body &piece = place_for_piece(w, b, w.next_id + i, free_name(w, whole, number));
    Share share = share_of(b, parts, i);
    shape_piece(b, std::move(share.mesh), std::move(share.open), piece);
    pieces.push_back(&piece);
    place_piece(w, piece.id);
  }
  report_removed(b, parts, out);
  Share rest = share_of(b, parts, kStays);
  const std::unique_ptr<BodyShape> before = cut_body(b, std::move(rest.mesh), std::move(rest.open), true);
  const auto put = [&](bool rolled_back) {
    for (Body *const p : pieces) set_place(w, *p, false, rolled_back);
    for (const auto &t : w.tools)  // they have room, and the ids of pieces are the highest
      if (rolled_back)
        std::erase_if(t->cuts.bodies, [&](uint64_t id) { return id >= w.next_id - pieces.size(); });
      else if (t->cuts_body(b))
        for (const Body *const p : pieces) t->cuts.bodies.push_back(p->id);
    w.next_id += rolled_back ? -uint64_t{parts.pieces} : parts.pieces;
    w.changed = true;
  };
  try {
    std::vector<CutTarget> targets{{b.id, &b, FeatureMap(before->surface, b.surface)}};
    for (const Body *const p : pieces) targets.push_back({p->id, p, FeatureMap(before->surface, p->surface)});
    Lasting lasting(w, *before, targets);
    reserve_ends(w, pieces.size());
    for (const auto &t : w.tools) t->cuts.bodies.reserve(t->cuts.bodies.size() + pieces.size());
    put(false);
    try {
      prepare_with(w, lasting);
    } catch (...) {
      put(true);
      throw;
    }
  } catch (...) {
    exchange(b, *before);
    throw;
  }
  b.separate.waits = false;
  out.pieces += parts.pieces;
  double kinetic_now = kinetic_of(b), elastic_now = elastic_energy(b);
  for (Body *const p : pieces) {
    kinetic_now += kinetic_of(*p);
    elastic_now += elastic_energy(*p);
    add_event(w, DFM_EVENT_PIECE, b.id, p->id, p->ncell(), w.time);
  }
  out.kinetic += kinetic - kinetic_now;
  out.elastic += elastic - elastic_now;
  log_small_parts(b, rule, parts);
}

void separate_if_requested(Body &b, CutReport &out) {
  if (!b.separate.on || b.emptied || out.parts < 2) return;
  CutReport report = out;
  if (found_memory([&] { separate(b, b.separate, report); })) {
    out = report;
    return;
  }
  if (!std::exchange(b.separate.waits, true))
    b.world->context->warn(b,
                           ": there is no memory to make its parts bodies of their own; they stay in it, and "
                           "the next steps try again");
}

void separate_if_requested(Body &b) {
  CutReport report;
  report.parts = kNone;  // unknown
  separate_if_requested(b, report);
}

void separate_what_waits(World &w) {
  const size_t n = w.bodies.size();  // new pieces come after
  for (size_t i = 0; i < n; ++i)
    if (w.bodies[i]->separate.waits) separate_if_requested(*w.bodies[i]);
}

Body &place_for_piece(World &w, const Body &of, uint64_t id, const std::string &name) {
  const uint64_t whole = of.piece_of ? of.piece_of : of.id;
  const auto is_it = [&](const auto &p) { return p->piece_of == whole && p->name == name; };
  auto at = std::ranges::find_if(w.rolled_back, is_it);
  if (at == w.rolled_back.end()) {
    auto fresh = std::make_unique<Body>();
    fresh->world = &w;
    fresh->rolled_back = true;
    fresh->handle = handle_create(Kind::body, fresh.get());
    at = w.rolled_back.insert(at, std::move(fresh));  // there is room
  }
  Body &b = **at;
  for (const auto &p : w.rolled_back)
    if (p->id == id) p->id += kMaxIds;
  b.id = id;
  std::ranges::sort(w.rolled_back, {}, [](const auto &p) { return p->id; });
  b.tears = of.tears;  // of none that a step sees
  b.sensor = of.sensor;
  b.name = name;
  b.material = of.material;
  b.user = of.user;
  b.piece_of = whole;
  b.whole_name = of.piece_of ? of.whole_name : of.name;
  static_cast<BodyState &>(b) = of;
  b.separate.waits = false;
  inherit_cuts(of, b);
  b.contact_impulse = {};
  b.energy = {};
  b.changes = {};
  b.bound.known = false;
  return b;
}

}  // namespace dfm
