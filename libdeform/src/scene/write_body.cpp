// Writes a soft body as part of a scene: its rest mesh (in separate files), its present positions and
// velocities, and what is prescribed for it.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "core/error.h"
#include "mesh/mesh.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "scene/keys.h"
#include "scene/table.h"
#include "scene/write.h"
#include "state/obstacle.h"
#include "step/solve/attach.h"
#include "world/body_model.h"
#include "world/model_change.h"

namespace dfm::writing {
namespace {

// Two groups of one name would be one.
uint32_t group_number(std::vector<MeshGroup> &groups, const std::string &name, int32_t dimension) {
  for (uint32_t g = 0; g < groups.size(); ++g)
    if (groups[g].name == name && groups[g].dimension == dimension) return g;
  MeshGroup group;
  group.name = name;
  group.dimension = dimension;
  group.tag = int32_t(groups.size()) + 1;
  groups.push_back(std::move(group));
  return uint32_t(groups.size()) - 1;
}

// The group of a surface triangle; empty: none.
const std::string &zone_group(const Body &b, uint32_t triangle) {
  return b.zones.list[b.zones.of.empty() ? 0 : b.zones.of[triangle]].group;
}

std::string material_group(const std::string &material) { return "material " + material; }

void write_cells(SceneWriter &to, const Body &b, Written &out) {
  RestMesh mesh;
  mesh.points.assign(b.p.rest.begin(), b.p.rest.end());
  mesh.tets.assign(b.tets.begin(), b.tets.end());
  mesh.cell = b.cell_type;
  mesh.cells.assign(b.cells.begin(), b.cells.end());
  mesh.share.assign(b.share.begin(), b.share.end());
  mesh.inside.assign(b.inside.begin(), b.inside.end());
  const uint32_t ntet = mesh.ntet();
  mesh.tet_group.assign(ntet, kNoGroup);
  std::vector<std::string> keys;
  for (const Material &m : b.composition.materials) keys.push_back(to.material(m));
  // the body's own, which rules by name mean, and which the others differ from
  size_t own = 0;
  while (own + 1 < keys.size() && b.composition.materials[own].name != b.material) ++own;
  if (b.composition.materials[own].name == b.material) out["material"] = keys[own];
  else if (!b.material.empty()) out["material"] = to.material(b.material, std::nullopt);
  if (out["material"].is_null() || out["material"] == "") out.erase("material");
  for (uint32_t t = 0; t < ntet; ++t) {
    const size_t m = b.composition.of.empty() ? 0 : b.composition.of[t];
    if (keys[m] == out.value("material", "")) continue;
    if (keys[m].empty()) {
      to.note(b, ": cells without a material lie beside others; a scene gives them '%s'", b.material.c_str());
      break;
    }
    mesh.tet_group[t] = group_number(mesh.groups, material_group(keys[m]), 3);
    out["materials_by_group"][material_group(keys[m])] = keys[m];
  }
  for (uint32_t t = 0; b.surface.identity() && t < b.surface.ntri; ++t) {
    if (zone_group(b, t).empty()) continue;
    for (size_t k = 0; k < 3; ++k) mesh.tris.push_back(b.surface.point[b.surface.tri[3 * size_t{t} + k]]);
    mesh.tri_group.push_back(group_number(mesh.groups, zone_group(b, t), 2));
  }
  out["mesh"] = to.file(b.name + ".vtu",
                        [mesh = std::move(mesh)](const std::string &to_path) { write_vtu(mesh, to_path); });
}

void write_surface(SceneWriter &to, const Body &b, Written &out) {
  const Surface &s = b.surface;
  if (s.identity()) return;
  RestMesh mesh;
  mesh.points.assign(s.rest.begin(), s.rest.end());
  mesh.tris.assign(s.tri.begin(), s.tri.end());
  for (uint32_t t = 0; t < s.ntri; ++t)
    mesh.tri_group.push_back(zone_group(b, t).empty() ? kNoGroup
                                                      : group_number(mesh.groups, zone_group(b, t), 2));
  Written &own = out["surface"];
  own["mesh"] = to.file(b.name + "_surface.vtu",
                        [mesh = std::move(mesh)](const std::string &to_path) { write_mesh(mesh, to_path); });
  own["coupling"] = scene::word_of("coupling", uint32_t(b.coupling));
  if (b.coupling != DFM_COUPLING_BARYCENTRIC && b.support > 0) own["support"] = b.support;
}

// ---- the model --------------------------------------------------------------------------------------------

// "type", "params" and "precision".
void write_choice(const dfm_type &type, const std::vector<GivenParam> &given, Written &out) {
  out["type"] = type.id;
  for (const GivenParam &p : given) {
    const dfm_param *const row = find_row(type, p.key.c_str());
    if (row) out["params"][p.key] = value_of(*row, p.values, p.width);
    else if (p.values[0] == 1) out["precision"] = "single";
  }
}

// With the values of now where they have been changed since the model was made.
void write_model(SceneWriter &to, const Body &b, Written &out) {
  const dfm_type &type = *b.model.type;
  std::vector<GivenParam> given = rows_of(b.origin.params);
  const std::vector<double> made = requested_values(to.w, b);
  const std::vector<double> &now =
      b.switched_off.requested.empty() ? b.model.params : b.switched_off.requested;
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i++].width) {
    const dfm_param &row = type.params[i];
    if (std::equal(&now[at], &now[at] + row.width, &made[at])) continue;
    if (std::any_of(b.fields.begin(), b.fields.end(), [&](const CellField &f) { return f.key == row.key; }))
      continue;
    std::erase_if(given, [&](const GivenParam &p) { return p.key == row.key; });
    given.push_back({row.key, &now[at], row.width});
  }
  write_choice(type, given, out["model"]);
  // Where a choice of the rule leaves its integrator open, so does the body, and the rule names those of its
  // other choices.
  const auto open = [](const SwitchRule &r) {
    const auto automatic = [](const ModelChoice &c) {
      return !c.type.empty() && c.integrator == uint32_t{DFM_INTEGRATOR_AUTO};
    };
    return automatic(r.touching) || automatic(r.near) || automatic(r.far);
  };
  if (!b.switches.empty() || std::ranges::none_of(b.rule, open)) put_integrator(out, b.origin.integrator);
  if (b.scaling.requested > 0) out["mass_scaling"] = b.scaling.requested;
  if (b.smooth > 0) out["smooth"] = b.smooth;
}

void write_fields(SceneWriter &to, const Body &b, Written &out) {
  for (const CellField &f : b.composition.given) {
    const dfm_param *const row = find_row(*b.model.type, f.key.c_str());
    if (!row || !(row->flags & DFM_PARAM_PER_CELL)) {
      to.note(b, ": the field '%s' is left out, since the model '%s' has no such parameter", f.key.c_str(),
              b.model.type->id);
      continue;
    }
    std::string rows = scene::columns_of(f.width) + "\n";
    for (size_t i = 0; i < f.values.size(); ++i)
      rows += format("%.17g%s", f.values[i], (i + 1) % f.width ? "," : "\n");
    out["fields"][f.key] = to.text_file(b.name + "_" + f.key + ".csv", std::move(rows));
  }
}

Written choice_of(SceneWriter &to, const ModelChoice &c) {
  Written out;
  write_choice(to.w.context->registry.find(DFM_KIND_MODEL, c.type.c_str()), rows_of(c.params), out);
  put_integrator(out, c.integrator);  // kSameIntegrator is none of the words
  return out;
}

// What is a matter of the present state, which a snapshot holds.
void note_state(SceneWriter &to, const std::string &sentence) {
  if (to.options.snapshot) to.remark(sentence + "; the snapshot contains its state");
  else to.note("%s", sentence.c_str());
}

void write_switches(SceneWriter &to, const Body &b, Written &out) {
  if (!b.switches.empty() && !b.rule.empty())
    to.note(b, ": a scene has either changes of the model by time or a rule; the rule is left out");
  for (const Switch &s : b.switches) {
    Written entry = choice_of(to, s.to);
    entry["t"] = std::max(s.t, 0.0);
    if (s.to.max_jump < HUGE_VAL) entry["max_jump"] = s.to.max_jump;
    out["switch"].push_back(std::move(entry));
  }
  if (b.rule.empty() || !b.switches.empty()) return;
  const SwitchRule &r = b.rule[0];
  Written &rule = out["switch"];
  if (!r.touching.type.empty()) rule["touching"] = choice_of(to, r.touching);
  if (!r.near.type.empty()) {
    rule["near"] = choice_of(to, r.near);
    rule["point"] = vector_of(r.point);
    rule["distance"] = r.distance;
    rule["hysteresis"] = r.hysteresis;
  }
  rule["far"] = choice_of(to, r.far);
  rule["wait"] = r.wait;
  if (!begins_alike(b, r))
    note_state(to, format("body '%s': the rule for its model begins anew in the scene, before any contact, "
                          "so its first step may change the model",
                          b.name.c_str()));
  if (r.far.max_jump < HUGE_VAL) rule["max_jump"] = r.far.max_jump;
}

// ---- present state ----------------------------------------------------------------------------------------

Vec3 made_at(const Body &b, uint32_t point) {
  dfm_pose frame{};
  store_pose(frame, b.origin.frame);
  return place(to_pose(frame), load3(&b.p.rest[3 * size_t{point}]));
}

void write_state(SceneWriter &to, const Body &b, Written &out) {
  put(out, "pose", pose_of(b.origin.frame));
  bool rests = true;
  for (uint32_t i = 0; i < b.p.n && rests; ++i) {
    const Vec3 x = made_at(b, i), v = load3(&b.p.v[kStride * size_t{i}]);
    rests = same_bits(&x, &b.p.x[kStride * size_t{i}], sizeof x) && norm2(v) == 0;
  }
  if (rests) return;
  if (!b.dynamics->abilities().placed) {
    note_state(to, format("body '%s': its model '%s' moves it as a whole, so a scene cannot describe its "
                          "present state; it begins at rest where it was created",
                          b.name.c_str(), b.model.type->id));
    return;
  }
  std::string rows = std::string(scene::kStateHeader) + "\n";
  for (uint32_t i = 0; i < b.p.n; ++i) {
    const double *const x = &b.p.x[kStride * size_t{i}], *const v = &b.p.v[kStride * size_t{i}];
    rows += format("%u,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", i, x[0], x[1], x[2], v[0], v[1], v[2]);
  }
  out["start"]["state"] = to.text_file(b.name + "_start.csv", std::move(rows));
}

// ---- what is prescribed -----------------------------------------------------------------------------------

std::string axes_of(uint8_t held) {
  std::string out;
  for (int k = 0; k < 3; ++k)
    if (held & (1 << k)) out += "xyz"[k];
  return out;
}

// An entry for each set of held components, in rising order of these.
void write_fix(const Body &b, const std::vector<uint32_t> &points, const Written &motion, Written &out) {
  std::map<uint8_t, std::vector<uint32_t>> by_axes;
  for (const uint32_t p : points)
    if (b.p.held[p]) by_axes[b.p.held[p]].push_back(p);
  for (auto &[held, list] : by_axes) {
    std::sort(list.begin(), list.end());
    Written entry;
    entry["points"] = list;
    entry["axes"] = axes_of(held);
    if (!motion.is_null()) entry["motion"] = motion;
    out["fix"].push_back(std::move(entry));
  }
}

void write_held(SceneWriter &to, const Body &b, Written &out) {
  std::vector<uint8_t> carried(b.p.n);
  for (const HeldMotion &m : b.motions)
    for (const uint32_t p : m.points) carried[p] = 1;
  std::vector<uint32_t> still;
  for (uint32_t i = 0; i < b.p.n; ++i)
    if (!carried[i]) still.push_back(i);
  write_fix(b, still, nullptr, out);
  for (const HeldMotion &m : b.motions) {
    Written motion;
    for (const dfm_pose_key &k : m.keys) motion["keyframes"].push_back(key_of(k));
    if (moves(m.sine) || m.keys.empty()) motion["sine"] = sine_of(m.sine, false);
    write_fix(b, m.points, motion, out);
    double away = 0;
    for (size_t i = 0; i < m.points.size(); ++i)
      away = std::max(away, norm(load3(&m.start[3 * i]) - made_at(b, m.points[i])));
    if (away > 1e-9 * b.surface.median_edge)
      to.note(b,
              ": held points move from where they stood when their motion was given, up to %g m from the "
              "rest shape; a scene moves them from the rest shape",
              away);
  }
}

void write_nodal(SceneWriter &to, const Body &b, const std::map<uint32_t, Vec3> &forces, Written &out) {
  if (forces.empty()) return;
  std::string rows = std::string(scene::kNodalHeader) + "\n";
  for (const auto &[point, f] : forces) rows += format("%u,0,0,0,%.17g,%.17g,%.17g\n", point, f.x, f.y, f.z);
  out["nodal_bc"] = to.text_file(b.name + "_forces.csv", std::move(rows));
}

// In their order, in which they are added: those from before any that varies are a table.
void write_loads(SceneWriter &to, const Body &b, Written &out) {
  std::map<uint32_t, Vec3> constant;
  bool table = true;
  for (const Load &l : b.loads) {
    table = table && l.keys.empty() && !moves(l.sine);
    for (size_t i = 0; i < l.points.size(); ++i) {
      const Vec3 f = load3(&l.force[3 * i]);
      if (table) {
        constant[l.points[i]] += f;
        continue;
      }
      Written entry;
      entry["points"] = {l.points[i]};
      entry["total"] = vector_of(f);
      for (const dfm_scale_key &k : l.keys) entry["keyframes"].push_back({{"t", k.t}, {"scale", k.value}});
      if (moves(l.sine)) entry["sine"] = sine_of(l.sine, true);
      out["forces"].push_back(std::move(entry));
    }
  }
  write_nodal(to, b, constant, out);
}

bool in_one_cell(const Body &b, const std::vector<uint32_t> &points) {
  for (size_t t = 0; t < b.tets.size(); t += 4)
    if (std::all_of(points.begin(), points.end(),
                    [&](uint32_t p) { return std::find(&b.tets[t], &b.tets[t] + 4, p) != &b.tets[t] + 4; }))
      return true;
  return false;
}

// Where a spring pulls: at the center of mass of points, or at a place in a cell.
bool write_spring_place(const Body &b, const Spring &s, Written &out) {
  double whole = 0;
  for (const uint32_t p : s.points) whole += b.p.mass[p];
  bool by_mass = true;
  for (size_t i = 0; i < s.points.size(); ++i)
    by_mass = by_mass && std::fabs(s.weights[i] - b.p.mass[s.points[i]] / whole) < 1e-12;
  if (by_mass) {
    std::vector<uint32_t> points = s.points;
    std::sort(points.begin(), points.end());
    out["points"] = points;
    return true;
  }
  if (!in_one_cell(b, s.points)) return false;
  Vec3 x;
  for (size_t i = 0; i < s.points.size(); ++i) x += s.weights[i] * load3(&b.p.rest[3 * size_t{s.points[i]}]);
  out["point"] = vector_of(x);
  return true;
}

void write_springs(SceneWriter &to, const Body &b, Written &out) {
  for (const Spring &s : b.springs) {
    Written entry;
    if (!write_spring_place(b, s, entry)) {
      to.note(b,
              ": a spring pulls at %zu points with its own weights, which a scene cannot describe; it is "
              "left out",
              s.points.size());
      continue;
    }
    if (s.keys.empty()) entry["to"] = vector_of(s.to);
    for (const dfm_vector_key &k : s.keys)
      entry["keyframes"].push_back({{"t", k.t}, {"position", vector_of(k.value)}});
    entry["stiffness"] = s.stiffness;
    if (s.damping > 0) entry["damping"] = s.damping;
    out["springs"].push_back(std::move(entry));
  }
}

void write_attachments(SceneWriter &to, const Body &b, Written &out) {
  for (const Attachment &a : to.w.attachments) {
    if (a.body != b.id || a.released) continue;
    const Body *const other = to.w.body(a.to);
    const Obstacle *const thing = to.w.obstacle(a.to);
    const std::string name = other ? other->name : thing ? thing->name : "";
    if (!to.has(name)) {
      to.note(b, ": its attachment to '%s' is left out, since the scene does not have that", name.c_str());
      continue;
    }
    Written entry;
    entry["to"] = name;
    std::vector<uint32_t> points;
    for (const uint32_t s : a.surfels) points.push_back(b.surface.identity() ? b.surface.point[s] : s);
    entry["points"] = points;
    if (a.stiffness > 0) entry["stiffness"] = a.stiffness;
    if (a.damping > 0) entry["damping"] = a.damping;
    if (a.release > 0) entry["release"] = a.release;
    if (a.flags & DFM_ATTACH_TOUCH) entry["touch"] = true;
    out["attach"].push_back(std::move(entry));
    double away = 0;
    for (size_t i = 0; i < a.surfels.size(); ++i)
      away = std::max(away, norm(b.surface.sum(a.surfels[i], b.p.x.data()) - attached_place(to.w, a, i)));
    if (away > 1e-6 * b.surface.median_edge)
      to.note(b, ": its attachment to '%s' is stretched by %g m now; in the scene it is at rest there",
              name.c_str(), away);
  }
}

}  // namespace

Written write_body(SceneWriter &to, Body &b) {
  to.check_name("body", b.name);
  b.dynamics->see_points();
  Written out;
  out["name"] = b.name;
  out["id"] = b.id;
  write_cells(to, b, out);
  write_surface(to, b, out);
  write_model(to, b, out);
  write_fields(to, b, out);
  write_state(to, b, out);
  write_held(to, b, out);
  write_loads(to, b, out);
  write_springs(to, b, out);
  write_attachments(to, b, out);
  if (b.separate.on)
    out["separate"] = {{"least_cells", b.separate.least},
                       {"crumbs", scene::word_of("crumbs", b.separate.removes)}};
  if (b.ahead.delay > 0) out["cut_delay"] = b.ahead.delay;
  if (!b.ahead.faces.empty())
    to.note(b, ": %zu faces that a tool has come through wait to be opened; in the scene they stay closed",
            b.ahead.faces.size() + b.ahead.later.size());
  write_switches(to, b, out);
  if (b.sensor) out["sensor"] = true;
  if (!b.cut.open.empty())
    to.note(b,
            " has been cut: the scene has it as it is now, but its cut faces are not set back, and the two "
            "sides of a slit do not touch");
  return out;
}

}  // namespace dfm::writing
