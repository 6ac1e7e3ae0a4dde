#include "problem.h"

#include <algorithm>

#include "body/phyxels.h"
#include "core/byte_stream.h"
#include "core/error.h"

namespace dfm {
namespace {

constexpr std::string_view kHead = "deform contact problem 1\n";

// What a column has an entry for; side: a row, where some row has a rigid body.
enum class Per { dof, row, contact, side };
// f(column, values of an entry, Per): what rows keep in a file, in its order.
template <class F>
void each_column(const F &f) {
  f(&ContactRows::source, 1, Per::dof);
  f(&ContactRows::point, 1, Per::dof);
  f(&ContactRows::block, 1, Per::dof);
  f(&ContactRows::rigid, 1, Per::side);
  f(&ContactRows::inverse_mass, 4, Per::dof);
  f(&ContactRows::y_free, 4, Per::dof);
  f(&ContactRows::arm, 3, Per::side);
  f(&ContactRows::frame, 9, Per::row);
  f(&ContactRows::drive, 3, Per::row);
  f(&ContactRows::rate, 1, Per::contact);
  f(&ContactRows::compliance, 3, Per::contact);
  f(&ContactRows::wn, 1, Per::row);
  f(&ContactRows::wt, 1, Per::row);
  f(&ContactRows::cross, 2, Per::contact);
  f(&ContactRows::impulse, 3, Per::row);
}

// Whether what only some have follows.
bool more(const ByteWriter &, bool has) { return has; }
bool more(const ByteReader &from, bool) { return !from.ended(); }

template <class C>
void copy_rows(const C &from, size_t width, const std::vector<uint32_t> &rows, C &to) {
  for (const uint32_t i : rows)
    to.insert(to.end(), from.begin() + std::ptrdiff_t(width * i),
              from.begin() + std::ptrdiff_t(width * (i + 1)));
}

// Numbers a list in which kNone stands for what is left out: the others get numbers in their order.
uint32_t number_all(std::vector<uint32_t> &used) {
  uint32_t n = 0;
  for (uint32_t &u : used)
    if (u != kNone) u = n++;
  return n;
}

}  // namespace

bool LinearMotion::linearize(ImplicitSystem &of) {
  const BlockPattern p = of.pattern();
  n = p.n;
  mass_ = of.mass();
  const size_t values = size_t{kStride} * n;
  pairs_.assign(p.ij, p.ij + 2 * size_t{p.nb});
  start_.assign(of.start(), of.start() + values);
  places_.assign(of.places(), of.places() + values);
  inverse_.assign(of.diagonal_inverse(), of.diagonal_inverse() + values);
  at_start_.resize(3 * size_t{n});
  blocks_.assign(9 * size_t{p.nb}, 0.0);
  std::vector<uint32_t> at(p.nb);
  for (uint32_t b = 0; b < p.nb; ++b) at[b] = b;
  return of.residual(start_.data(), at_start_.data()) && of.matrix(at.data(), blocks_.data());
}

bool LinearMotion::residual(const double *v, double *r) {
  changes_.resize(3 * size_t{n});
  for (size_t k = 0; k < changes_.size(); ++k) {
    const size_t at = size_t{kStride} * (k / 3) + k % 3;
    changes_[k] = v[at] - start_[at];
    r[k] = at_start_[k];
  }
  const auto add = [&](uint32_t row, uint32_t column, const double *a, size_t down, size_t across) {
    for (size_t i = 0; i < 3; ++i)
      for (size_t j = 0; j < 3; ++j)
        r[3 * size_t{row} + i] += a[down * i + across * j] * changes_[3 * size_t{column} + j];
  };
  for (size_t b = 0; 2 * b < pairs_.size(); ++b) {
    add(pairs_[2 * b], pairs_[2 * b + 1], &blocks_[9 * b], 3, 1);
    if (pairs_[2 * b] != pairs_[2 * b + 1]) add(pairs_[2 * b + 1], pairs_[2 * b], &blocks_[9 * b], 1, 3);
  }
  for (size_t k = 0; k < changes_.size(); ++k)
    if (!(inverse_[size_t{kStride} * (k / 3) + k % 3] > 0)) r[k] = 0;
  return true;
}

bool LinearMotion::matrix(const uint32_t *at, double *blk) {
  for (size_t b = 0; 2 * b < pairs_.size(); ++b)
    for (size_t k = 0; k < 9; ++k) blk[9 * size_t{at[b]} + k] += blocks_[9 * b + k];
  return true;
}

bool LinearMotion::is_valid() const {
  const auto none_beyond = [&](uint32_t k) { return k < n; };
  return start_.size() == size_t{kStride} * n && places_.size() == start_.size() &&
         inverse_.size() == start_.size() && at_start_.size() == 3 * size_t{n} &&
         2 * blocks_.size() == 9 * pairs_.size() && std::ranges::all_of(pairs_, none_beyond);
}

template <class Transfer>
void LinearMotion::transfer(Transfer &t) {
  t.one(n);
  if (n == 0) return;
  t.one(mass_);
  t.many(pairs_);
  t.many(start_);
  t.many(places_);
  t.many(inverse_);
  t.many(at_start_);
  t.many(blocks_);
}

// number: of the dofs that are taken, in their order.
void ContactProblem::take_blocks(const ContactRows &from, const std::vector<uint32_t> &number) {
  rows.block.assign(rows.ndof, kNone);
  for (const ContactRows::Block &b : from.blocks) {
    if (number[b.first] == kNone) continue;
    const auto values = from.response_.begin() + std::ptrdiff_t(b.response);
    const size_t place = rows.response_.size();
    rows.response_.insert(rows.response_.end(), values, values + std::ptrdiff_t{12} * b.count * b.count);
    std::fill_n(rows.block.begin() + number[b.first], b.count, uint32_t(rows.blocks.size()));
    rows.blocks.push_back({b.source, number[b.first], b.count, place, b.group});
  }
}

bool ContactProblem::take(const ContactRows &from, const RowsPart &part, const ContactState &of,
                          std::span<ImplicitSystem *const> systems) {
  std::vector<uint32_t> list, contacts, dofs;
  each_row(part.contacts, [&](uint32_t i) { contacts.push_back(i); });
  list = contacts;
  each_row(part.bonds, [&](uint32_t i) { list.push_back(i); });
  std::vector<uint32_t> number(from.ndof, kNone), sources(systems.size(), kNone), bonds;
  for (const uint32_t b : part.blocks)
    std::fill_n(number.begin() + from.blocks[b].first, from.blocks[b].count, 0);
  for (const uint32_t i : list)
    for (uint32_t j = from.begin[i]; j < from.begin[i + 1]; ++j) number[from.dof[j]] = 0;
  for (uint32_t d = 0; d < from.ndof; ++d)
    if (number[d] != kNone && from.source[d] != kNone) sources[from.source[d]] = 0;
  number_all(number);
  motions.resize(number_all(sources));
  for (uint32_t d = 0; d < from.ndof; ++d)
    if (number[d] != kNone) dofs.push_back(d);
  rows.n = part.n;
  rows.ndof = static_cast<uint32_t>(dofs.size());
  rows.nrigid =
      static_cast<uint32_t>(std::ranges::count_if(contacts, [&](uint32_t i) { return i >= from.soft(); }));
  rows.nbond = part.nbond;
  each_column([&](auto column, size_t width, Per per) {
    if (per != Per::side || !from.rigid.empty())
      copy_rows(from.*column, width,
                per == Per::dof       ? dofs
                : per == Per::contact ? contacts
                                      : list,
                rows.*column);
  });
  take_blocks(from, number);
  for (size_t s = 0; s < systems.size(); ++s) {
    if (sources[s] == kNone) continue;
    rows.whole_of.push_back(from.whole_of[s]);
    if (systems[s] && !motions[sources[s]].linearize(*systems[s])) return false;
  }
  for (uint32_t d = 0; d < rows.ndof; ++d) {
    uint32_t &s = rows.source[d];
    if (s != kNone) s = sources[s];
    if (rows.block[d] != kNone || motions[s].n == 0) continue;
    std::fill_n(&rows.y_free[size_t{kStride} * d], kStride, 0.0);  // what moves it is its system
    std::fill_n(&rows.inverse_mass[size_t{kStride} * d], kStride, 0.0);
  }
  for (ContactRows::Block &b : rows.blocks)
    if (b.source != kNone) b.source = sources[b.source];
  rows.begin.assign(1, 0);
  for (const uint32_t i : list) {
    for (uint32_t j = from.begin[i]; j < from.begin[i + 1]; ++j) {
      rows.dof.push_back(number[from.dof[j]]);
      rows.weight.push_back(from.weight[j]);
    }
    rows.begin.push_back(static_cast<uint32_t>(rows.dof.size()));
  }
  if (rows.nrigid) {
    copy_rows(from.rigid_a, 1, list, rows.rigid_a);
    copy_rows(from.arm_a, 3, list, rows.arm_a);
  }
  if (rows.nrigid && !from.arc.empty()) {
    copy_rows(from.arc, 9, list, rows.arc);
    copy_rows(from.arc_a, 9, list, rows.arc_a);
  }
  for (Array<uint32_t> *side : {&rows.rigid, &rows.rigid_a})
    for (uint32_t &d : *side)
      if (d != kNone) d = number[d];
  each_row(part.bonds, [&](uint32_t i) { bonds.push_back(i - from.n); });
  copy_rows(from.bond, 1, bonds, rows.bond);
  state.resize(part.n, of.nstate);
  for (uint32_t k = 0; k < part.n; ++k) {
    const uint32_t i = contacts[k];
    state.law[k] = of.law[i];
    state.area[k] = of.area[i];
    state.dwell[k] = of.dwell[i];
    if (!of.scale.empty()) state.scale.push_back(of.scale[i]);
    for (size_t s = 0; s < of.nstate; ++s)
      state.bristle[s * state.stride + k] = of.bristle[s * of.stride + i];
  }
  return true;
}

template <class Transfer>
void ContactProblem::transfer(Transfer &t) {
  for (double *x : {&h, &rest, &bond, &most_normal}) t.one(*x);
  t.many(normal);
  t.many(tangent);
  t.count(laws);
  for (Law &law : laws) {
    t.many(law.id);
    t.many(law.params);
  }
  for (uint32_t *x : {&rows.n, &rows.nbond, &rows.ndof, &state.nstate}) t.one(*x);
  t.many(rows.begin);
  t.many(rows.dof);
  t.many(rows.weight);
  each_column([&](auto column, size_t, Per) { t.many(rows.*column); });
  t.many(rows.whole_of);
  t.count(rows.blocks);
  for (ContactRows::Block &b : rows.blocks) {
    for (uint32_t *x : {&b.source, &b.first, &b.count, &b.group}) t.one(*x);
    t.one(b.response);
  }
  t.many(rows.response_);
  t.count(rows.bond);
  for (ContactRows::BondRow &b : rows.bond) {
    for (Vec3 *v : {&b.rate, &b.inverse[0], &b.inverse[1], &b.inverse[2], &b.along}) t.one(*v);
    for (double *x : {&b.soft, &b.most, &b.max_work, &b.w}) t.one(*x);
    bool stuck = false;  // of drags: in files of this version, read by nothing
    t.one(stuck);
  }
  t.many(state.law);
  t.many(state.area);
  t.many(state.dwell);
  t.many(state.scale);
  t.many(state.bristle);
  t.count(motions);
  for (LinearMotion &m : motions) m.transfer(t);
  if (!more(t, rows.nrigid > 0)) return;
  t.one(rows.nrigid);
  t.many(rows.rigid_a);
  for (Array<double> *a : {&rows.arm_a, &rows.arc, &rows.arc_a}) t.many(*a);
}

std::string ContactProblem::bytes() {
  std::string out{kHead};
  ByteWriter writer(out);
  transfer(writer);
  return out;
}

// Whether every number in it names something that is there.
void ContactProblem::check() const {
  const size_t n = rows.n, all = size_t{rows.all()}, ndof = rows.ndof, stride = (n + 7) & ~size_t{7};
  bool good = normal.size() == n && tangent.size() == n && rows.begin.size() == all + 1 &&
              rows.dof.size() == rows.weight.size() && rows.begin.back() == rows.dof.size() &&
              std::ranges::is_sorted(rows.begin) && rows.whole_of.size() == motions.size() &&
              rows.bond.size() == rows.nbond && state.law.size() == stride && state.area.size() == stride &&
              state.dwell.size() == stride && (state.scale.empty() || state.scale.size() == n) &&
              state.bristle.size() == stride * state.nstate;
  each_column([&](auto column, size_t width, Per per) {
    const size_t entries = per == Per::dof ? ndof : per == Per::contact ? n : all;
    good = good && ((rows.*column).size() == width * entries || (per == Per::side && rows.rigid.empty()));
  });
  const size_t sides = rows.nrigid ? all : 0, arcs = rows.arc.empty() ? 0 : 9 * all;
  good = good && rows.nrigid <= n && rows.rigid.size() >= sides && rows.rigid_a.size() == sides &&
         rows.arm_a.size() == 3 * sides && rows.arc.size() == arcs && rows.arc_a.size() == arcs;
  size_t values = 0;
  for (const ContactRows::Block &b : rows.blocks) {
    if (b.count > ndof || b.first > ndof - b.count) good = false;
    if (!good) break;
    good = b.response == values;
    values += size_t{12} * b.count * b.count;
    const auto own = [&](uint32_t k) { return k == uint32_t(&b - rows.blocks.data()); };
    good = good && std::all_of(rows.block.begin() + b.first, rows.block.begin() + b.first + b.count, own);
  }
  good = good && rows.response_.size() == values && std::ranges::all_of(motions, &LinearMotion::is_valid);
  for (uint32_t i = 0; i < rows.dof.size() && good; ++i) good = rows.dof[i] < ndof;
  for (const Array<uint32_t> *const side : {&rows.rigid, &rows.rigid_a})
    for (const uint32_t d : *side) good = good && (d == kNone || size_t{d} + 1 < ndof);
  for (uint32_t i = 0; i < n && good; ++i) good = state.law[i] < laws.size();
  for (uint32_t d = 0; d < ndof && good; ++d)
    good = rows.block[d] != kNone
               ? rows.block[d] < rows.blocks.size()
               : rows.source[d] < motions.size() &&
                     (motions[rows.source[d]].n == 0 || rows.point[d] < motions[rows.source[d]].n);
  if (!good) fail(DFM_E_FORMAT, "the contact problem is damaged: its sizes do not fit each other");
}

void ContactProblem::read(std::string_view bytes) {
  if (bytes.substr(0, kHead.size()) != kHead)
    fail(DFM_E_FORMAT, "this is no contact problem of this version of the library");
  ByteReader reader(bytes.substr(kHead.size()), "contact problem");
  transfer(reader);
  if (!reader.ended()) fail(DFM_E_FORMAT, "the contact problem is longer than it says");
  check();
  state.resize(rows.n, state.nstate);
  rows.y.assign(rows.y_free.begin(), rows.y_free.end());
  rows.restore(rows.whole());
}

}  // namespace dfm
