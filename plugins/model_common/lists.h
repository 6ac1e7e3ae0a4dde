// Lists one after the other in one array, by a counting sort: the items of list k are item[begin[k]] up to
// item[begin[k + 1]], in the order in which they came.
#pragma once
#include "buffer.h"

namespace model {

// each(use) calls use(list, item) for all of them, and does so twice.
template <class T, class Each>
void make_lists(const dfm_host *host, size_t lists, const Each &each, Buffer<uint32_t> &begin,
                Buffer<T> &item) {
  begin.create(host, lists + 1);
  each([&](size_t k, const T &) { ++begin[k + 1]; });
  for (size_t k = 0; k < lists; ++k) begin[k + 1] += begin[k];
  item.create(host, begin[lists]);
  each([&](size_t k, const T &x) { item[begin[k]++] = x; });
  for (size_t k = lists; k > 0; --k) begin[k] = begin[k - 1];  // each was its list's end
  begin[0] = 0;
}

}  // namespace model
