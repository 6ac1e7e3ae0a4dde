// The result of the rules of friction and contact: the laws of a world, and the law of each pair.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "contact/contact_set.h"
#include "friction/laws.h"
#include "state/pair_tables.h"

namespace dfm {

struct FrictionRule;
struct SceneFacts;
struct Obstacle;
struct World;

// Index of the law with these values: an existing one, else a new one, at an index that `free` marks or at
// the end.
uint32_t add_law(World &w, const char *name, std::span<const dfm_param_value> values,
                 std::span<const uint8_t> free = {}, double restitution = kNoRestitution);
// The same for the requested law without the effects that the list leaves out.
std::unique_ptr<LawInstance> make_law(const World &w, const dfm_type &type, std::vector<double> requested,
                                      double restitution);
uint32_t place_law(World &w, std::unique_ptr<LawInstance> law, std::span<const uint8_t> free);

// What the tables hold for a pair: its law, and of zones that differ the place of their laws in zone_law.
struct PairLaw {
  uint32_t law = kNone, zones = kNone;
  bool found() const { return law != kNone; }
};
// Fills the tables for things a and b (bodies by slot, then obstacles). used: their laws, out.
PairLaw find_law(World &w, uint32_t a, uint32_t b, std::vector<uint32_t> &used);
// The same with what find_law has returned for two things of the same kinds (PairOfKinds, step/prepare.cpp).
void put_law(World &w, uint32_t a, uint32_t b, const PairLaw &known);
uint32_t law_of_zones(World &w, uint32_t a, uint32_t zone_a, uint32_t b, uint32_t zone_b);
uint32_t pair_law(const World &w, uint32_t slot_a, bool obstacle, uint32_t slot_b);
// That of its zones, where these have laws of their own.
uint32_t contact_law(const World &w, const ContactPoint &c);
// The effects of the law with its present parameters, and with other parameters.
void offer_law(const LawInstance &law, SceneFacts &facts);
void rename_law(World &w, const FrictionRule &rule, uint32_t to);  // in the store, of contacts it holds for

}  // namespace dfm
