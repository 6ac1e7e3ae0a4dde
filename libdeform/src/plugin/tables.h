// Converts structs of a plugin, which may be built against an older or newer header, to the size of this
// library: common members are copied, a missing tail is zero.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "deform/plugin.h"

namespace dfm {

// no struct of this ABI is ever larger; a larger size is an error
constexpr uint32_t kLargestStruct = 1u << 16;

[[noreturn]] inline void bad_type(const std::string &id, const std::string &what) {
  fail(DFM_E_UNSUPPORTED, "type \"%s\" is not usable: %s", id.c_str(), what.c_str());
}

// The first member of every struct is its size; head: bytes that every version has.
template <class T>
void copy_struct(T &full, const void *from, size_t head, const std::string &id, const char *name) {
  uint32_t size;
  std::memcpy(&size, from, sizeof size);
  if (size < head || size > kLargestStruct)
    bad_type(id,
             format("%s.size is %u, at least %zu expected; set it to sizeof(%s)", name, size, head, name));
  full = T{};
  std::memcpy(&full, from, std::min<size_t>(size, sizeof(T)));
  full.size = sizeof(T);
}

// The table of an extension of a model, or nothing.
template <class T>
std::optional<T> copy_table(const void *from, size_t head, const std::string &id, const char *name) {
  if (!from) return std::nullopt;
  std::optional<T> full{T{}};
  copy_struct(*full, from, head, id, name);
  return full;
}

// Row i of a list whose rows may be longer or shorter than those of this library.
template <class Row>
Row row_at(const Row *rows, uint32_t row_size, uint32_t i) {
  Row row{};
  std::memcpy(&row, reinterpret_cast<const char *>(rows) + size_t(row_size) * i,
              std::min<size_t>(row_size, sizeof row));
  return row;
}

// Rows of state slots; throws Error, which names the type, if unit, kind and width of a slot do not agree.
std::vector<dfm_slot> copy_slots(const std::string &id, const dfm_slot *slots, uint32_t n, uint32_t slot_size,
                                 bool law);
// null: nothing
std::optional<std::vector<dfm_slot>> copy_slots(const std::string &id, const dfm_slots *own, bool law);

}  // namespace dfm
