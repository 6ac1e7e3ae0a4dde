#include "contact/rows.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/lists.h"
#include "math/width.h"

namespace dfm {
namespace {

// Sources are in ascending order of their first nodes.
uint32_t source_of_node(std::span<const DofSource> sources, uint32_t node) {
  return uint32_t(std::ranges::upper_bound(sources, node, {}, &DofSource::first_node) - sources.begin()) - 1;
}

}  // namespace

ContactRows::ContactRows(const Memory &m) : kernels_(dense_kernels()) {
  use_memory(m, begin, dof, weight, y, y_free, inverse_mass, source, point, block, blocks, response_,
             unit_response_, frame, drive, rate, borne, start_depth, compliance, wn, wt, cross, impulse, bond,
             dof_of_point_, dof_of_node_, place_, rigid, arm, rigid_a, arm_a, arc, arc_a, dof_of_group_,
             every_block_, whole_of);
}

// Adds a block of the dofs from `first` on.
void ContactRows::add_block(uint32_t from, uint32_t first, uint32_t group) {
  const uint32_t count = ndof - first;
  blocks.push_back({from, first, count, response_.size(), group});
  response_.resize(response_.size() + size_t(12) * count * count);
}

void ContactRows::add_rigid_block(uint32_t group, uint32_t bodies) {
  dof_of_group_[group] = ndof;
  for (uint32_t k = 0; k < 2 * bodies; ++k) {
    source.push_back(kNone);
    point.push_back(k);
    block.push_back(static_cast<uint32_t>(blocks.size()));
  }
  ndof += 2 * bodies;
  add_block(kNone, dof_of_group_[group], group);
}

// Blocks of the rigid groups that are touched, in their order.
void ContactRows::build_rigid(std::span<const ContactPoint> contacts, const RigidPlaces &rigids,
                              std::span<const Bond> bonds, std::span<const RigidSides> between_rigids) {
  rigid.assign(all(), kNone);
  arm.resize(size_t(3) * all());
  dof_of_group_.assign(rigids.group_size.size(), kNone);
  const auto touch = [&](uint32_t group) {
    if (group != kNone) dof_of_group_[group] = 0;
  };
  for (const ContactPoint &c : contacts)
    if (c.obstacle) touch(rigids.of_obstacle[c.slot_b].group);
  for (const Bond &b : bonds)
    if (b.obstacle) touch(rigids.of_obstacle[b.slot_b].group);
  for (const RigidSides &c : between_rigids) {
    touch(c.a.group);
    touch(c.b.group);
  }
  for (uint32_t g = 0; g < rigids.group_size.size(); ++g)
    if (dof_of_group_[g] != kNone) add_rigid_block(g, rigids.group_size[g]);
}

// Both sides of the last contacts, and their frames.
void ContactRows::set_rigid_sides(std::span<const RigidSides> between_rigids) {
  rigid_a.assign(all(), kNone);
  arm_a.resize(size_t(3) * all());
  for (uint32_t i = soft(); i < n; ++i) {
    const RigidSides &c = between_rigids[i - soft()];
    const auto set = [&](const RigidPlace &r, Array<uint32_t> &of, Array<double> &arms) {
      if (r.group != kNone) of[i] = dof_of_group_[r.group] + 2 * r.place;
      store3(&arms[size_t(3) * i], c.at - r.center);
    };
    set(c.b, rigid, arm);
    set(c.a, rigid_a, arm_a);
    double *const f = &frame[size_t(9) * i];
    store3(f, c.normal);
    store3(f + 3, c.tangent);
    store3(f + 6, dfm::cross(c.normal, c.tangent));
  }
}

void ContactRows::clear() {
  for (Array<uint32_t> *a : {&begin, &dof, &source, &point, &block, &rigid, &rigid_a}) a->clear();
  for (Array<double> *a : {&weight, &response_, &whole_of, &arc, &arc_a}) a->clear();
  blocks.clear();
  ndof = 0;
}

// From the rigid body's center to where the impulse acts on the soft body: the same point on both sides, so
// that angular momentum is kept to rounding.
void ContactRows::set_arms(std::span<const ContactPoint> contacts, std::span<const DofSource> sources,
                           const RigidPlaces &rigids, std::span<const Bond> bonds) {
  const auto set = [&](uint32_t i, const auto &c) {
    if (!c.obstacle || rigids.of_obstacle[c.slot_b].group == kNone) return;
    const RigidPlace &r = rigids.of_obstacle[c.slot_b];
    rigid[i] = dof_of_group_[r.group] + 2 * r.place;
    Vec3 at;
    for (uint32_t k = 0; k < c.nnode; ++k) {
      const DofSource &s = sources[source_of_node(sources, c.node[k])];
      const uint32_t surfel = c.node[k] - s.first_node;
      at += c.weight[k] * load3(s.place ? s.place + size_t(s.surface->point[surfel]) * 4
                                        : &s.surface->x[size_t(surfel) * 4]);
    }
    store3(&arm[size_t(3) * i], at - r.center);
  };
  for (uint32_t i = 0; i < soft(); ++i) set(i, contacts[i]);
  for (uint32_t i = 0; i < nbond; ++i) set(n + i, bonds[i]);
}

void ContactRows::build(std::span<const ContactPoint> contacts, std::span<const DofSource> sources,
                        const RigidPlaces &rigids, std::span<const Bond> bonds,
                        std::span<const RigidSides> between_rigids) {
  // Dofs are numbered in order of first use, except that those of a self-stepping body follow each other (its
  // response is one block).
  nrigid = static_cast<uint32_t>(between_rigids.size());
  n = static_cast<uint32_t>(contacts.size()) + nrigid;
  nbond = static_cast<uint32_t>(bonds.size());
  frame.resize(size_t(9) * all());
  for (Array<double> *a : {&drive, &impulse}) a->resize(size_t(3) * all());
  for (Array<double> *a : {&wn, &wt}) a->resize(all());
  compliance.resize(size_t(3) * n);
  cross.resize(size_t(2) * n);
  rate.resize(n);
  uint32_t nnode = 0, npoint = 0;
  for (const DofSource &s : sources) {
    nnode = std::max(nnode, s.first_node + s.nnode);
    npoint = std::max(npoint, s.first_point + s.npoint);
  }
  clear();
  for (const DofSource &s : sources) whole_of.push_back(s.whole);

  const auto source_of = [&](uint32_t node) { return source_of_node(sources, node); };
  // Pass 1: touched surfels of self-stepping bodies, ascending, one block each.
  if (std::ranges::any_of(sources, [](const DofSource &s) { return !s.diagonal; }))
    dof_of_node_.assign(nnode, kNone);
  for (uint32_t s = 0; s < sources.size(); ++s) {
    if (sources[s].diagonal) continue;
    const uint32_t first = ndof;
    const auto touch = [&](const auto &c) {
      for (uint32_t k = 0; k < c.nnode; ++k)
        if (source_of(c.node[k]) == s) dof_of_node_[c.node[k]] = 0;
    };
    for (const ContactPoint &c : contacts) touch(c);
    for (const Bond &b : bonds) touch(b);
    for (uint32_t node = sources[s].first_node; node < sources[s].first_node + sources[s].nnode; ++node) {
      if (dof_of_node_[node] == kNone) continue;
      dof_of_node_[node] = ndof++;
      source.push_back(s);
      point.push_back(node - sources[s].first_node);
      block.push_back(static_cast<uint32_t>(blocks.size()));
    }
    if (ndof > first) add_block(s, first, kNone);
  }
  if (!rigids.group_size.empty() || nrigid) {
    build_rigid(contacts, rigids, bonds, between_rigids);
    if (nrigid) set_rigid_sides(between_rigids);
    set_arms(contacts, sources, rigids, bonds);
  }
  // Pass 2: contacts to dofs. A coupled surfel expands to its phyxels; a phyxel that comes twice in one
  // contact is merged.
  if (!std::exchange(points_free_, false) || dof_of_point_.size() != npoint)
    dof_of_point_.assign(npoint, kNone);
  auto dof_of = [&](uint32_t s, uint32_t phyxel) {
    uint32_t &d = dof_of_point_[sources[s].first_point + phyxel];
    if (d == kNone) {
      d = ndof++;
      source.push_back(s);
      point.push_back(phyxel);
      block.push_back(kNone);
    }
    return d;
  };
  for (uint32_t i = 0; i < all(); ++i) {
    if (i >= soft() && i < n) {
      begin.push_back(static_cast<uint32_t>(dof.size()));
      continue;
    }
    const bool contact = i < n;
    const uint32_t nodes = contact ? contacts[i].nnode : bonds[i - n].nnode;
    const uint32_t *const node = contact ? contacts[i].node : bonds[i - n].node;
    const double *const share = contact ? contacts[i].weight : bonds[i - n].weight;
    begin.push_back(static_cast<uint32_t>(dof.size()));
    const uint32_t row = begin.back();
    // Entries of other contacts in the table are recognized: they do not match the columns of this row.
    auto add = [&](uint32_t d, double w) {
      if (d >= place_.size()) place_.resize(d + 1);
      const uint32_t at = place_[d];
      if (at >= row && at < dof.size() && dof[at] == d) {
        weight[at] += w;
        return;
      }
      place_[d] = static_cast<uint32_t>(dof.size());
      dof.push_back(d);
      weight.push_back(w);
    };
    for (uint32_t k = 0; k < nodes; ++k) {
      const uint32_t s = source_of(node[k]), surfel = node[k] - sources[s].first_node;
      const Surface &surface = *sources[s].surface;
      if (!sources[s].diagonal) {
        add(dof_of_node_[node[k]], share[k]);
      } else if (surface.identity()) {
        add(dof_of(s, surface.point[surfel]), share[k]);
      } else {
        surface.each_phyxel(surfel, [&](uint32_t phyxel, double w) { add(dof_of(s, phyxel), share[k] * w); });
      }
    }
  }
  begin.push_back(static_cast<uint32_t>(dof.size()));
  y.resize(size_t(ndof) * 4);
  inverse_mass.resize(size_t(ndof) * 4);
  for (uint32_t d = 0; d < ndof; ++d) {
    // a rigid body's change of velocity: what it has without contact is the contact's own `velocity`
    if (source[d] == kNone) {
      std::fill_n(&y[size_t(d) * 4], 4, 0.0);
      std::fill_n(&inverse_mass[size_t(d) * 4], 4, 0.0);
      continue;
    }
    const DofSource &s = sources[source[d]];
    if (block[d] == kNone) dof_of_point_[s.first_point + point[d]] = kNone;
    for (uint32_t k = 0; k < 4; ++k) {
      y[size_t(d) * 4 + k] = s.velocity[size_t(point[d]) * 4 + k];
      inverse_mass[size_t(d) * 4 + k] = s.diagonal ? s.diagonal[size_t(point[d]) * 4 + k] : 0;
    }
  }
  points_free_ = true;
}

// The rigid bodies' share in the change of relative velocity by an impulse a on one side, -a on the other.
Vec3 ContactRows::rigid_diagonal(uint32_t i, Vec3 a) const {
  Vec3 sum;
  each_rigid(i, [&](uint32_t from, Vec3 at, double by, const double *) {
    const Vec3 p = by * a, moment = dfm::cross(at, p);
    const double q[6] = {p.x, p.y, p.z, moment.x, moment.y, moment.z};
    each_rigid(i, [&](uint32_t to, Vec3 r, double sign, const double *) {
      if (block[to] != block[from]) return;
      const Block &b = blocks[block[from]];
      double v[6];
      for (size_t row = 0; row < 6; ++row) {
        v[row] = 0;
        for (size_t k = 0; k < 6; ++k)
          v[row] += response(b, 3 * size_t(from - b.first) + k, to - b.first + row / 3, row % 3) * q[k];
      }
      sum += sign * (load3(v) + dfm::cross(load3(v + 3), r));
    });
  });
  return sum;
}

// 1/kg: what the implicit bodies of contact i answer as a whole; their nodes have the rest.
double ContactRows::whole_response(uint32_t i) const {
  double sum = 0;
  for (uint32_t j = begin[i], last = kNone; j < begin[i + 1]; ++j) {
    const uint32_t d = dof[j], s = block[d] == kNone ? source[d] : kNone;
    if (s != kNone && s != std::exchange(last, s)) sum += whole_of[s];
  }
  return sum;
}

// a^T W a for a unit world direction a, as a vector so that mixed terms come out too: returns (W a).
Vec3 ContactRows::diagonal(uint32_t i, Vec3 a) const {
  Vec3 sum;
  for (uint32_t j = begin[i]; j < begin[i + 1]; ++j) {
    const uint32_t d = dof[j];
    if (block[d] == kNone) {
      sum += (weight[j] * weight[j]) * response_alone(d, a);
      continue;
    }
    const Block &b = blocks[block[d]];
    for (uint32_t l = begin[i]; l < begin[i + 1]; ++l) {
      if (block[dof[l]] != block[d]) continue;
      const size_t at = d - b.first, column = size_t(3) * (dof[l] - b.first);
      const double ww = weight[j] * weight[l];
      for (uint32_t row = 0; row < 3; ++row)
        sum[int(row)] += ww * (response(b, column, at, row) * a.x + response(b, column + 1, at, row) * a.y +
                               response(b, column + 2, at, row) * a.z);
    }
  }
  if (!rigid.empty()) sum += rigid_diagonal(i, a);
  return sum;
}

namespace {

// Share of the largest entry: less is the rounding of a held point, which has a row of zeros.
constexpr double kMoves = 1e-12;

// What nodes answer by themselves, and their bodies as a whole: with these, nodes that are held do not move.
double with_whole(double own, double least, double whole) { return own > least ? own + whole : 0; }

}  // namespace

void ContactRows::set_diagonal(uint32_t i) {
  const double *const f = &frame[size_t(9) * i];
  const Vec3 normal = load3(f), t1 = load3(f + 3), t2 = load3(f + 6);
  const double body = whole_response(i);
  const Vec3 w0 = diagonal(i, normal), w1 = diagonal(i, t1), w2 = diagonal(i, t2);
  const double own = dot(normal, w0);
  cross[2 * size_t(i)] = dot(t1, w0);
  cross[2 * size_t(i) + 1] = dot(t2, w0);
  const double a = dot(t1, w1), c = dot(t2, w2), b = dot(t1, w2);
  const double across = 0.5 * (a + c) + std::sqrt(0.25 * (a - c) * (a - c) + b * b);
  const double least = kMoves * std::max(own, across);
  wn[i] = with_whole(own, least, body);
  wt[i] = with_whole(across, least, body);
}

namespace {

// A depth closes by a fifth per sub-step. Closed at once it would leave the bodies apart at gap / h, and a
// contact that comes with a little depth (an edge of a face that bends) would bounce off, come back deeper,
// and never rest.
constexpr double kCloses = 0.2;
// The last part of the distance must be kept: a point that slides over a turning face comes nearer by slip
// times rotation in every sub-step, which the straight motion of the contact does not include. Deeper than
// 0.4 d_c the whole of a further depth is closed in the sub-step: (1 - kCloses) 0.4 of d_c may remain.
constexpr double kStays = 0.32;
// Compliance of contacts that give way, in units of W_nn. A crossing that gives way then bears a hundredth of
// what its own response would need, nearly nothing. With 3 it shared the load with the surfels beside it,
// through a spring as soft as the contacts themselves, and sweeps took twice as many to agree on the shares
// (doc/decisions/contact_problem.md).
constexpr double kSoft = 100;
// Surfaces that cross at the start are opened slowly: by this share of d_c per sub-step.
constexpr double kOpens = 0.1;

// m/s at which contact may approach, or has to open. most: m, the largest depth that one sub-step closes.
double bias_velocity(double distance, double offset, double h, double planned, double most) {
  const double gap = distance - offset;
  if (gap > 0) return gap / h;
  const double slow = std::max(kCloses * gap, -most);
  const double near = distance > 0 ? gap + kStays * offset : slow;
  return std::min(slow, near) / planned;
}

// (W + soft)^-1 of the components in which anything moves.
void invert(const Vec3 (&w)[3], Vec3 (&out)[3]) {
  double a[3][6] = {};
  const double least = kMoves * std::max({w[0].x, w[1].y, w[2].z});
  bool free[3];
  for (int i = 0; i < 3; ++i) {
    free[i] = w[i][i] > least;
    for (int j = 0; j < 3; ++j) a[i][j] = 0.5 * (w[i][j] + w[j][i]);
    a[i][3 + i] = 1;
  }
  for (int k = 0; k < 3; ++k) {
    if (!free[k]) continue;
    // of components that move as one, the first does
    free[k] = a[k][k] > least;
    if (!free[k]) continue;
    const double pivot = 1 / a[k][k];
    for (double &x : a[k]) x *= pivot;
    for (int i = 0; i < 3; ++i) {
      if (i == k) continue;
      const double by = a[i][k];
      for (int j = 0; j < 6; ++j) a[i][j] -= by * a[k][j];
    }
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[i][j] = free[i] && free[j] ? a[i][3 + j] : 0;
}

}  // namespace

void ContactRows::finish_bonds(std::span<const Bond> bonds) {
  bond.resize(nbond);
  for (uint32_t k = 0; k < nbond; ++k) {
    const uint32_t i = n + k;
    const Bond &b = bonds[k];
    double *const f = &frame[size_t(i) * 9];
    std::fill_n(f, 9, 0.0);
    f[0] = f[4] = f[8] = 1;
    store3(&drive[size_t(i) * 3], b.velocity);
    Vec3 w[3];
    for (int c = 0; c < 3; ++c) {
      Vec3 along;
      along[c] = 1;
      w[c] = diagonal(i, along);
    }
    const double body = whole_response(i), least = kMoves * std::max({w[0].x, w[1].y, w[2].z});
    for (int c = 0; c < 3; ++c) w[c][c] = with_whole(w[c][c], least, body);
    wn[i] = w[0].x;
    wt[i] = std::max(w[1].y, w[2].z);
    BondRow &row = bond[k];
    row.rate = b.rate;
    row.soft = b.soft + b.softness * std::max(w[0].x, wt[i]);
    row.along = b.along;
    row.most = b.most;
    row.max_work = b.max_work;
    if (row.drags()) {
      row.w = dot(b.along, diagonal(i, b.along));
      continue;
    }
    for (int c = 0; c < 3; ++c) w[c][c] += row.soft;
    invert(w, row.inverse);
  }
}

void ContactRows::finish(std::span<const ContactPoint> contacts, const double *tangents, double h,
                         double planned, double offset, std::span<const Bond> bonds, Tasks *tasks) {
  impulse.resize(size_t(3) * all());  // the start has those of contacts alone
  const double most = recovery > 0 ? recovery * planned : kOpens * offset;
  const auto fill = [&](uint32_t i) {
    const Vec3 normal = load3(contacts[i].normal);
    const Vec3 t1 = load3(tangents + size_t(i) * 3);
    const Vec3 t2 = dfm::cross(normal, t1);
    double *const f = &frame[size_t(i) * 9];
    store3(f, normal);
    store3(f + 3, t1);
    store3(f + 6, t2);
    const Vec3 v = load3(contacts[i].velocity);
    store3(&drive[size_t(i) * 3], in_frame(f, v));
    const double from = start_depth.empty() ? 0 : start_depth[i];
    rate[i] = bias_velocity(contacts[i].distance + from, offset, h, planned, most);
    set_diagonal(i);
    // min(c l, m) balances the opening speed of a depth `indentation` at most: no load presses it deeper.
    compliance[3 * size_t(i)] = contacts[i].indentation > 0 ? kSoft * wn[i] : 0;
    compliance[3 * size_t(i) + 1] = kCloses * contacts[i].indentation / planned;
    compliance[3 * size_t(i) + 2] = 0;
  };
  each_row_in_blocks(soft(), tasks, fill);
  if (nbond) finish_bonds(bonds);
}

void ContactRows::soften_openings(std::span<const double> firm) {
  for (uint32_t i = 0; i < soft(); ++i) {
    const double speed = -rate[i];
    if (!(speed > 0) || !(wn[i] > 0) || (!firm.empty() && firm[i] > 0)) continue;
    double *const yield = &compliance[3 * size_t(i)];
    // a crossing that gives way bears almost nothing while it opens
    if (yield[0] > 0) {
      yield[1] = std::max(yield[1], speed);
      continue;
    }
    yield[0] = wn[i];
    yield[1] = speed;
    yield[2] = borne[i];
  }
}

double ContactRows::load_without_opening(uint32_t i) const {
  const double l = impulse[3 * size_t(i)], *const yield = &compliance[3 * size_t(i)];
  if (!(yield[2] > 0)) return l;
  const double most = yield[1] / yield[0], by = std::clamp(l - yield[2], 0.0, most);
  return l - by * by / most;
}

// u: what the dofs of the row give, in the world's axes.
Vec3 ContactRows::velocity_with_rigids(uint32_t i, const double *of, Vec3 u) const {
  Vec3 turned;
  each_rigid(i, [&](uint32_t d, Vec3 r, double sign, const double *turns) {
    const double *const v = of + size_t(d) * 4;
    const Vec3 spin = load3(v + 4);
    u += sign * (load3(v) + dfm::cross(spin, r));
    if (turns) turned += sign * in_frame(turns, spin);
  });
  return in_frame(&frame[size_t(i) * 9], u) + turned - load3(&drive[size_t(i) * 3]);
}

// along: between values of one answer of unit_response_; across: from one answer to the next.
void ContactRows::take_response(const Block &b, size_t along, size_t across) {
  double *to = &response_[b.response];
  for (size_t column = 0; column < size_t(3) * b.count; ++column)
    for (size_t k = 0; k < b.count; ++k) {
      for (size_t row = 0; row < 3; ++row) *to++ = unit_response_[(3 * k + row) * along + column * across];
      *to++ = 0;
    }
}

void ContactRows::response_apply(const Block &b, uint32_t d, Vec3 p) {
  const size_t width = size_t(4) * b.count;
  kernels_.add_three(width, &response_[b.response + 3 * size_t(d - b.first) * width], &p.x,
                     &y[size_t(b.first) * 4]);
}

void ContactRows::apply_to_rigids(uint32_t i, Vec3 p) {
  each_rigid(i, [&](uint32_t d, Vec3 r, double sign, const double *) {
    response_apply(blocks[block[d]], d, sign * p);
    response_apply(blocks[block[d]], d + 1, sign * dfm::cross(r, p));
  });
}

void ContactRows::apply_to_blocks(uint32_t i, Vec3 p) {
  apply_to_rigids(i, p);
  for (uint32_t j = begin[i]; j < begin[i + 1]; ++j) {
    const uint32_t d = dof[j];
    if (block[d] != kNone) response_apply(blocks[block[d]], d, weight[j] * p);
    else add3(&y[size_t(d) * 4], weight[j] * response_alone(d, p));
  }
}

void ContactRows::restart_rigids() {
  for (const Block &b : blocks)
    if (b.group != kNone)
      std::copy_n(&y[size_t(4) * b.first], size_t(4) * b.count, &y_free[size_t(4) * b.first]);
  for (uint32_t i = 0; i < all(); ++i) apply_to_rigids(i, world_impulse(i));
}

namespace {

// When the largest diagonal of a response has fallen to this share, the rest is rounding.
constexpr double kRounding = 1e-13;

}  // namespace

// Each block's response is R = L L^T, by Cholesky's method that takes the largest diagonal next (Higham 1990)
// and stops where nothing is left: the columns of L are motions that answer unit impulses.
void ContactRows::motions(std::span<const uint32_t> of_blocks, Motions &out) const {
  Array<double> &columns = out.columns, &left = out.left;
  columns.clear();
  for (Array<size_t> *a : {&out.first_column, &out.column_count, &out.first_value})
    a->assign(blocks.size(), 0);
  size_t found = 0;
  for (const uint32_t number : of_blocks) {
    const Block &b = blocks[number];
    const size_t size = size_t(3) * b.count, start = columns.size();
    const auto value = [&](size_t row, size_t column) { return response(b, column, row / 3, row % 3); };
    out.first_column[number] = found;
    out.first_value[number] = start;
    left.resize(size);
    double top = 0;
    for (size_t k = 0; k < size; ++k) top = std::max(top, left[k] = value(k, k));
    for (size_t own = 0; own < size; ++own) {
      const size_t pivot = size_t(std::max_element(left.begin(), left.end()) - left.begin());
      if (!(left[pivot] > kRounding * top)) break;
      ++found;
      const size_t at = columns.size();
      columns.resize(at + size);
      const double *const before = &columns[start];
      const double root = std::sqrt(left[pivot]);
      for (size_t k = 0; k < size; ++k) {
        double sum = value(k, pivot);
        for (size_t c = 0; c < own; ++c) sum -= before[c * size + k] * before[c * size + pivot];
        columns[at + k] = sum / root;
        left[k] = std::max(0.0, left[k] - columns[at + k] * columns[at + k]);
      }
      left[pivot] = 0;
    }
    out.column_count[number] = found - out.first_column[number];
  }
  out.rank = static_cast<uint32_t>(found);
  const size_t triples = (found + 2) / 3;
  out.g.assign(9 * triples, 0.0);
  out.s.assign(arc.empty() ? 0 : out.g.size(), 0.0);
  out.touched.clear();
}

void ContactRows::motion_row(uint32_t i, Motions &out) const {
  for (const uint32_t q : out.touched) {
    std::fill_n(&out.g[size_t{9} * q], 9, 0.0);
    if (!out.s.empty()) std::fill_n(&out.s[size_t{9} * q], 9, 0.0);
  }
  out.touched.clear();
  const double *const f = &frame[size_t(9) * i];
  // use(column of G, values of the motion at dof d)
  const auto each_motion = [&](uint32_t d, auto &&use) {
    const uint32_t number = block[d];
    if (number == kNone) return;
    const Block &b = blocks[number];
    for (size_t c = 0; c < out.column_count[number]; ++c)
      use(out.first_column[number] + c,
          &out.columns[out.first_value[number] + c * 3 * b.count + size_t(3) * (d - b.first)]);
  };
  const auto add = [](Array<double> &to, size_t column, const double *by, Vec3 u) {
    for (size_t row = 0; row < 3; ++row)
      to[9 * (column / 3) + 3 * row + column % 3] += dot(load3(by + 3 * row), u);
  };
  // what each motion of its block makes of the contact's velocity
  const auto put = [&](uint32_t d, auto &&change) {
    each_motion(d, [&](size_t column, const double *at) {
      if (out.touched.empty() || out.touched.back() != column / 3)
        out.touched.push_back(static_cast<uint32_t>(column / 3));
      add(out.g, column, f, change(at));
    });
  };
  for (uint32_t j = begin[i]; j < begin[i + 1]; ++j)
    put(dof[j], [&](const double *at) { return weight[j] * load3(at); });
  each_rigid(i, [&](uint32_t d, Vec3 r, double sign, const double *) {
    put(d, [&](const double *at) { return sign * (load3(at) + dfm::cross(load3(at + 3), r)); });
  });
  sort_unique(out.touched);
  if (arc.empty()) return;
  for (const uint32_t q : out.touched) std::copy_n(&out.g[size_t{9} * q], 9, &out.s[size_t{9} * q]);
  each_rigid(i, [&](uint32_t d, Vec3, double sign, const double *turns) {
    each_motion(d, [&](size_t column, const double *at) { add(out.s, column, turns, sign * load3(at + 3)); });
  });
}

}  // namespace dfm
