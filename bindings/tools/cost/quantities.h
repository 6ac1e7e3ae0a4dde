// What is compared: figures of a run over time, read from its files, and how far two runs differ in them.
#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

namespace cli::cost {

// A figure over time, or an event.
struct Quantity {
  std::string family;  // probe, com, force, work, volume, energy, touch, slip, rest
  std::string unit;
  unsigned width = 1;                    // components
  bool event = false;                    // values[0]: its time, NaN where it does not happen
  std::vector<double> t, values, rates;  // [n], [n, width], [n, width] or empty
};
using Quantities = std::map<std::string, Quantity>;

// The quantities of a finished run. A probe ends with the last record before a cut takes its cell.
Quantities read_quantities(const std::string &folder);

// What differences are divided by: of positions the root mean square of how far the reference moves, at
// least `least`; of other figures the largest value; of events the duration.
double scale_of(const Quantity &reference, double least, double duration);
// Root mean square of the difference over the time that both have, divided by scale; NaN where it cannot be
// said.
double error_of(const Quantity &q, const Quantity &reference, double scale);

// [width], at a time between two records: cubic by values and rates where there are rates, else straight.
// rates: 0 where there are none.
void value_at(const Quantity &q, double t, double *values, double *rates);

// The quantities that a word names: one, or a family.
std::vector<std::string> named(const Quantities &all, const std::string &word);

}  // namespace cli::cost
