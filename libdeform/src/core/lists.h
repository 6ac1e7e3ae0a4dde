// Sorted arrays, and lists one after the other in one array by a counting sort: the items of list k are
// item[begin[k]] up to item[begin[k + 1]], in the order in which they came.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace dfm {

// Ascending, each once.
template <class Items>
void sort_unique(Items &items) {
  std::sort(items.begin(), items.end());
  items.erase(std::unique(items.begin(), items.end()), items.end());
}

// each(use) calls use(list, item) for all of them, and does so twice.
template <class Begin, class Items, class Each>
void make_lists(size_t lists, const Each &each, Begin &begin, Items &item) {
  begin.assign(lists + 1, 0);
  each([&](size_t k, const auto &) { ++begin[k + 1]; });
  for (size_t k = 0; k < lists; ++k) begin[k + 1] += begin[k];
  item.resize(begin[lists]);
  each([&](size_t k, const auto &x) { item[begin[k]++] = x; });
  for (size_t k = lists; k > 0; --k) begin[k] = begin[k - 1];  // each was its list's end
  begin[0] = 0;
}

// The numbers below n, i in list key(i).
template <class Begin, class Items, class Key>
void list_by(size_t lists, size_t n, const Key &key, Begin &begin, Items &item) {
  const auto each = [&](const auto &use) {
    for (uint32_t i = 0; i < n; ++i) use(key(i), i);
  };
  make_lists(lists, each, begin, item);
}

}  // namespace dfm
