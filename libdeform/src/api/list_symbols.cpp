// The lists that are inline in the headers, as symbols of the library: for callers that look functions up by
// name without a C compiler and so have no sizeof. Rows are those of 0.1 and stay so.
//
// In this file the headers' inline functions have other names.
#define dfm_world_contacts contacts_inline
#define dfm_world_pairs pairs_inline
#define dfm_world_pair_impulses pair_impulses_inline
#define dfm_world_events events_inline
#define dfm_world_overlaps overlaps_inline
#define dfm_world_profile profile_inline
#define dfm_world_swaps swaps_inline
#include "deform/contact.h"
#include "deform/model.h"
#include "deform/world.h"
#undef dfm_world_contacts
#undef dfm_world_pairs
#undef dfm_world_pair_impulses
#undef dfm_world_events
#undef dfm_world_overlaps
#undef dfm_world_profile
#undef dfm_world_swaps

// bytes: of a row in 0.1.
#define DFM_LIST_SYMBOL(name, row, bytes)                                                         \
  extern "C" DFM_API dfm_status name(dfm_world world, uint32_t capacity, row *out, uint32_t *n) { \
    return name##_sized(world, bytes, capacity, out, n);                                          \
  }
DFM_LIST_SYMBOL(dfm_world_contacts, dfm_contact, 192)
DFM_LIST_SYMBOL(dfm_world_pairs, dfm_pair_report, 128)
DFM_LIST_SYMBOL(dfm_world_pair_impulses, dfm_pair_impulse, 104)
DFM_LIST_SYMBOL(dfm_world_events, dfm_contact_event, 40)
DFM_LIST_SYMBOL(dfm_world_overlaps, dfm_overlap, 40)
DFM_LIST_SYMBOL(dfm_world_profile, dfm_stage_time, 24)
DFM_LIST_SYMBOL(dfm_world_swaps, dfm_swap, 64)
