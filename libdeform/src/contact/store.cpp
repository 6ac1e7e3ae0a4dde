#include "contact/store.h"

#include <algorithm>
#include <numeric>

#include "contact/contact_state.h"
#include "contact/rows_part.h"
#include "geometry/surface.h"

namespace dfm {

ContactStore::ContactStore(const Memory &m) {
  each_column([&](const ContactColumn &, auto &column) { use_memory(m, column); }, *this);
}

uint32_t ContactStore::find(uint64_t k) const {
  const auto it = std::lower_bound(by_key.begin(), by_key.end(), k,
                                   [&](uint32_t i, uint64_t value) { return key[i] < value; });
  return it != by_key.end() && key[*it] == k ? *it : kNone;
}

void ContactStore::order() {
  by_key.resize(n);
  std::iota(by_key.begin(), by_key.end(), 0u);
  std::sort(by_key.begin(), by_key.end(),
            [&](uint32_t i, uint32_t j) { return key[i] != key[j] ? key[i] < key[j] : i < j; });
}

void ContactStore::drop(uint64_t id) {
  uint32_t left = 0;
  for (uint32_t i = 0; i < n; ++i) {
    if (id_a[i] == id || id_b[i] == id) continue;
    const auto move = [&](const ContactColumn &column, auto &values) {
      const size_t width = column.entries(1, nstate);
      if (values.size() == width * n)
        std::copy_n(values.data() + width * i, width, values.data() + width * left);
    };
    if (left < i) each_column(move, *this);
    ++left;
  }
  if (left == n) return;
  const auto shorten = [&](const ContactColumn &column, auto &values) {
    const size_t width = column.entries(1, nstate);
    if (values.size() == width * n) values.resize(width * left);
  };
  each_column(shorten, *this);
  n = left;
  order();
}

Vec3 transport(Vec3 t, Vec3 m, Vec3 n, bool *reset) {
  const double c = dot(m, n);
  *reset = c < -0.5;
  if (*reset) return any_tangent(n);
  // rotation m -> n applied to a vector orthogonal to m
  const Vec3 turned = t - (dot(n, t) / (1 + c)) * (m + n);
  return normalized(turned - dot(turned, n) * n);  // rounding only
}

void warm_start(const ContactStore &old, std::span<const ContactPoint> contacts, double h,
                Array<double> &impulse, ContactState &state, double *tangents, uint32_t *match,
                Tasks *tasks) {
  const double scale = old.h > 0 ? h / old.h : 0;
  impulse.resize(size_t(contacts.size()) * 3);
  each_row_in_blocks(static_cast<uint32_t>(contacts.size()), tasks, [&](uint32_t i) {
    const Vec3 n = load3(contacts[i].normal);
    const uint32_t m = match[i] = old.find(contacts[i].key);
    double *const l = &impulse[size_t(i) * 3];
    l[0] = l[1] = l[2] = 0;
    for (uint32_t s = 0; s < state.nstate; ++s) state.bristle[size_t(s) * state.stride + i] = 0;
    state.dwell[i] = 0;
    bool reset = true;
    Vec3 t;
    if (m != kNone)
      t = transport(load3(&old.turned[size_t(m) * 3]), load3(&old.normal[size_t(m) * 3]), n, &reset);
    else t = any_tangent(n);
    store3(tangents + size_t(i) * 3, t);
    if (reset) {
      match[i] = kNone;
      return;
    }
    // the first row of a contact bears its load
    if (contacts[i].more == 0) {
      l[0] = scale * old.lasting[m];
      l[1] = scale * old.impulse[size_t(m) * 3 + 1];
      l[2] = scale * old.impulse[size_t(m) * 3 + 2];
    }
    state.dwell[i] = old.dwell[m];
    // The columns have the width of the law with the largest state; the values of a law come first.
    if (old.law[m] == state.law[i])
      for (uint32_t s = 0; s < std::min(old.nstate, state.nstate); ++s)
        state.bristle[size_t(s) * state.stride + i] = old.bristle[size_t(m) * old.nstate + s];
  });
}

}  // namespace dfm
