// The measured costs that the planner reads: JSON as `deform calibrate` writes it (doc/reference/outputs.md).
#include "core/system.h"
#include "scene/planner/planner.h"
#include "shipped_costs.h"

namespace dfm::scene {
namespace {

std::vector<CostAt> read_sizes(const Node &sizes) {
  std::vector<CostAt> out;
  for (const Node &size : sizes.items()) {
    const double points = size.at("points").number(kPositive);
    if (!out.empty() && !(points > out.back().points)) size.at("points").fail("sizes must increase");
    out.push_back({points, size.at("ns_per_point").number(kPositive)});
    if (size.has("short_ns_per_point")) out.back().short_ns = size.at("short_ns_per_point").number(kPositive);
  }
  if (out.empty()) sizes.fail("expected at least one size");
  return out;
}

void read_cells(const Node &node, MeasuredCells &m) {
  m.wave_steps = node.at("wave_steps").number(kNotNegative);
  const Node costs = node.at("costs");
  for (size_t s = 0; s < kSchemes; ++s) {
    const char *const scheme = scheme_name(static_cast<Scheme>(s));
    if (!costs.has(scheme)) continue;
    for (size_t k = 0; k < kMeets; ++k)
      m.costs[s][k] = read_sizes(costs.member(scheme).at(meets_name(static_cast<Meets>(k))));
  }
}

MeasuredModel read_model(const Node &node) {
  MeasuredModel m;
  m.id = node.at("model").text();
  if (node.has("machine")) m.machine = node.member("machine").text();
  m.steps_itself = node.at("steps_itself").boolean();
  read_cells(node, m);
  if (node.has("hexahedra")) read_cells(node.member("hexahedra"), m.hexahedra);
  const Node errors = node.at("errors");
  m.bends_little = errors.at("bends_little").number(kNotNegative);
  m.bends_far = errors.at("bends_far").number(kNotNegative);
  m.turns = errors.at("turns").number(kNotNegative);
  m.lies = errors.at("lies").number(kNotNegative);
  m.dents = errors.at("dents").number(kNotNegative);
  m.dent_force = errors.at("dent_force").number(kNotNegative);
  return m;
}

}  // namespace

Measured read_costs() {
  const std::optional<std::string> named = os::environment("DEFORM_COSTS");
  const std::string file = named && !named->empty() ? *named : "(costs that the library ships)";
  json tree = named && !named->empty() ? parse_file(file) : parse_text(kShippedCosts, file);
  const Node root(&tree, "", &file);
  if (root.at("format").text() != "deform-costs")
    root.at("format").fail("expected \"deform-costs\", a file of deform calibrate");
  const double version = root.at("version").number();  // 3: without costs of short steps
  if (version != 3 && version != 4)
    root.at("version").fail("this reader knows versions 3 and 4: run deform calibrate again");
  Measured out;
  out.machine = root.at("machine").text();
  for (const Node &model : root.at("models").items()) out.models.push_back(read_model(model));
  return out;
}

}  // namespace dfm::scene
