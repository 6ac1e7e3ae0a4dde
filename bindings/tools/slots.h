// Rows of a table of state slots as this version knows them, whatever header the plugin was built against.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstring>
#include <optional>
#include <vector>

#include "deform/plugin.h"

namespace cli {

// dfm_slot is 16 bytes in ABI 1; longer rows are of a later type, shorter ones are an error.
constexpr uint32_t kSlotHead = 16;
static_assert(sizeof(dfm_slot) == kSlotHead);

inline bool is_slot_size(uint32_t slot_size) {
  return slot_size == 0 ||
         (slot_size >= kSlotHead && slot_size <= 65536 && slot_size % sizeof(uint32_t) == 0);
}

// slot_size is sound.
inline std::vector<dfm_slot> slot_rows(const dfm_slot *slots, uint32_t n, uint32_t slot_size) {
  const size_t row = slot_size ? slot_size : kSlotHead;
  std::vector<dfm_slot> out(slots ? n : 0);
  for (size_t i = 0; i < out.size(); ++i)
    std::memcpy(&out[i], reinterpret_cast<const char *>(slots) + i * row, std::min(row, sizeof(dfm_slot)));
  return out;
}

// The rows of what dfm_friction.state or DFM_EXT_SLOTS answered; nothing where it is no such table.
inline std::optional<std::vector<dfm_slot>> slot_rows(const dfm_slots *own) {
  constexpr size_t kHead = offsetof(dfm_slots, slots) + sizeof(void *);
  if (!own || own->size < kHead || own->size > 65536) return std::nullopt;
  dfm_slots full{};
  std::memcpy(&full, own, std::min<size_t>(own->size, sizeof full));
  if (full.nslot > 4096 || (full.nslot && !full.slots) || !is_slot_size(full.slot_size)) return std::nullopt;
  return slot_rows(full.slots, full.nslot, full.slot_size);
}

}  // namespace cli
