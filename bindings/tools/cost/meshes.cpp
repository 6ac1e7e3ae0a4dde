#include "study.h"

namespace cli::cost {
namespace {

// Keys of a body that name parts of its mesh: groups, cells by number, nodes by number.
std::string named_part(const Subject &subject, const std::string &body) {
  for (const char *key : {"/materials_by_group", "/fields", "/nodal_bc", "/anisotropy/field"})
    if (subject.find(body + key)) return std::string(key).substr(1);
  for (const char *list : {"/fix", "/forces", "/springs", "/attach"}) {
    const JsonValue *const rows = subject.find(body + list);
    for (size_t i = 0; rows && i < rows->items.size(); ++i)
      for (const char *by : {"group", "points"})
        if (rows->items[i].find(by)) return std::string(list).substr(1) + " by " + by;
  }
  return "";
}

}  // namespace

std::string why_cells_stay(const Subject &subject) {
  for (size_t i = 0; i < subject.bodies.size(); ++i) {
    const std::string body = "/bodies/" + std::to_string(i);
    const JsonValue *const mesh = subject.find(body + "/mesh");
    if (!mesh) return "body '" + subject.bodies[i].name + "' has no mesh of its own";
    const std::string part = named_part(subject, body);
    if (!part.empty() && !subject.find(body + "/fill"))
      return "body '" + subject.bodies[i].name + "' has " + part +
             ", which belongs to the cells of its mesh and not to others";
    if (const JsonValue *const cells = subject.find(body + "/fill/cells"); cells && cells->text == "0")
      return "body '" + subject.bodies[i].name + "' has no cells, only its surface";
    if (mesh->kind == JsonValue::object) continue;
    if (subject.find(body + "/surface/mesh"))
      return "body '" + subject.bodies[i].name + "' has a separate surface";
  }
  return "";
}

}  // namespace cli::cost
