#include "output.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>

#include "json_text.h"
#include "messages.h"
#include "system.h"

namespace fs = std::filesystem;

namespace cli {

static std::string csv_number(double x) {
  return std::isfinite(x) ? number(x) : std::isnan(x) ? "nan" : x > 0 ? "inf" : "-inf";
}

// ---- tables -----------------------------------------------------------------------------------------------

Csv::Csv(const std::string &path, const std::string &header) : path_(path), file_(new_file(path)) {
  block_ = header + "\n";
  flush();
}

Csv &Csv::cell(const std::string &text) {
  if (!first_) block_ += ',';
  first_ = false;
  block_ += csv_cell(text);
  return *this;
}

Csv &Csv::cell(double x) { return cell(csv_number(x)); }

Csv &Csv::cells(const double *x, int n) {
  for (int i = 0; i < n; ++i) cell(x[i]);
  return *this;
}

void Csv::end_row() {
  block_ += '\n';
  first_ = true;
}

void Csv::flush() {
  if (std::fwrite(block_.data(), 1, block_.size(), file_.get()) != block_.size() ||
      std::fflush(file_.get()) != 0)
    cannot_write(path_);
  block_.clear();
}

// ---- a run's files ----------------------------------------------------------------------------------------

Outputs::Outputs(const SceneFile &scene, const std::string &folder)
    : scene_(scene),
      folder_(folder),
      held_(folder),
      bodies_(folder + "/bodies.csv",
              "t,body,com_x,com_y,com_z,vel_x,vel_y,vel_z,ang_x,ang_y,ang_z,kinetic_J,elastic_J,volume,force_"
              "x,force_y,force_z") {
  const dfm_scene_settings &s = scene.settings();
  if (s.contacts)
    contacts_ = std::make_unique<Csv>(
        folder + "/contacts.csv",
        "t,body_a,body_b,count,sticking,normal_N,friction_N,moment_Nm,slip_max,friction_work_J");
  probes_ = std::make_unique<Csv>(folder + "/probes.csv", "t,probe,x,y,z,vx,vy,vz");
  if (s.states) {
    make_folder(folder + "/states");
    index_ = std::make_unique<Csv>(folder + "/states/index.csv", "index,t");
  }
  last_time_ = dfm_world_time(scene.world());
  if (!s.nodes) return;
  for (const BodyView &body : scene.bodies()) nodes_.push_back(file_nodes(body));
}

void Outputs::record() {
  scene_.renew_list();
  const double t = dfm_world_time(scene_.world());
  write_bodies(t);
  if (contacts_) write_contacts(t);
  write_probes(t);
  if (index_) {
    write_states(formatted("_%06u", recorded_));
    index_->cell(std::to_string(recorded_)).cell(t).end_row();
    index_->flush();
  }
  ++recorded_;
  last_time_ = t;
}

// handle: of a soft or a rigid body.
void Outputs::write_body(double t, uint64_t handle, const std::string &name, const dfm_body_measure &m) {
  double force[3] = {0, 0, 0};
  std::array<double, 3> &last = last_impulse_[handle];
  for (size_t k = 0; k < 3; ++k) {
    if (t > last_time_) force[k] = (m.contact_impulse[k] - last[k]) / (t - last_time_);
    last[k] = m.contact_impulse[k];
  }
  bodies_.cell(t).cell(name).cells(m.com, 3).cells(m.velocity, 3).cells(m.angular, 3);
  bodies_.cell(m.kinetic).cell(m.elastic).cell(m.volume).cells(force, 3).end_row();
}

void Outputs::write_bodies(double t) {
  for (const BodyView &body : scene_.bodies()) write_body(t, body.handle, body.name, body_measure(body));
  for (const RigidView &rigid : scene_.rigids())
    write_body(t, rigid.handle, rigid.name, rigid_measure(rigid));
  bodies_.flush();
}

void Outputs::write_contacts(double t) {
  for (const dfm_pair_report &p : listed<dfm_pair_report>(dfm_world_pairs, scene_.world())) {
    contacts_->cell(t).cell(scene_.name_of(p.a)).cell(scene_.name_of(p.b));
    contacts_->cell(std::to_string(p.count)).cell(std::to_string(p.sticking));
    contacts_->cell(p.normal)
        .cell(norm(p.friction))
        .cell(norm(p.moment))
        .cell(p.slip_max)
        .cell(p.friction_work)
        .end_row();
  }
  contacts_->flush();
}

void Outputs::write_probes(double t) {
  for (uint32_t i = 0; i < scene_.settings().nprobe; ++i) {
    const char *name = nullptr;
    double x[3], v[3];
    need(dfm_scene_probe(scene_.scene(), i, &name, x, v));
    probes_->cell(t).cell(name).cells(x, 3).cells(v, 3).end_row();
  }
  probes_->flush();
}

void Outputs::write_states(const std::string &suffix) {
  for (const BodyView &body : scene_.bodies()) {
    need(dfm_debug_write_body(body.handle, state_path(body.name + suffix).c_str()));
    need(dfm_debug_write_surface(body.handle, state_path(body.name + "_surface" + suffix).c_str()));
  }
}

void Outputs::write_last() {
  make_folder(folder_ + "/states");
  for (const BodyView &body : scene_.bodies()) {
    need(dfm_debug_write_body(body.handle, state_path("last_" + body.name).c_str()));
    need(dfm_debug_write_surface(body.handle, state_path("last_" + body.name + "_surface").c_str()));
  }
}

// The numbers of the mesh file's nodes. Of a filled body they are the first points of
// the surface that it wears (those of split edges follow); where it wears another one, its own points are
// numbered in their order.
FileNodes Outputs::file_nodes(const BodyView &body) const {
  const std::string key = scene_.pointer_of(body.name);
  const auto has = [&](const char *what) { return scene_.value(key + what).starts_with('{'); };
  JsonValue mesh;
  if (!parse_json(scene_.value(key + "/mesh"), mesh))
    throw Failure(kBadInput, "body \"" + body.name + "\" has no mesh file");
  if (mesh.kind == JsonValue::object) {  // made, not read: its points are the body's
    FileNodes own;
    own.body = body.handle;
    own.name = body.name;
    for (uint32_t i = 0; i < body.npoint; ++i) own.number.push_back(i);
    return own;
  }
  const std::string path = name_of(path_of(scene_.path()).parent_path() / path_of(mesh.text));
  FileNodes out;
  out.body = body.handle;
  out.name = body.name;
  dfm_mesh_handle read = 0;
  const bool lattice = has("/lattice"), own_cells = !lattice && !has("/fill");
  need(dfm_mesh_load(scene_.context(), path.c_str(), own_cells ? DFM_MESH_ANY : DFM_MESH_SURFACE, &read));
  const dfm_mesh_info info = got<dfm_mesh_info>(dfm_mesh_get_info, read);
  if (own_cells && info.ntet) {
    out.number.assign(info.file_point, info.file_point + body.npoint);
  } else {
    out.surface = !lattice && scene_.value(key + "/surface/mesh").empty() &&
                  scene_.value(key + "/surface/from").empty();
    out.number.resize(out.surface ? info.npoint : body.npoint);
    for (uint32_t i = 0; i < out.number.size(); ++i) out.number[i] = i;
    if (out.surface) std::copy_n(info.file_point, out.number.size(), out.number.begin());
  }
  dfm_mesh_destroy(read);
  return out;
}

// Displacements of the nodes, [n,3]: NAN where a cut has taken the node. A cut gives points new numbers,
// pieces take points along, and of the copies of a point the first one counts.
std::vector<double> Outputs::node_displacements(const FileNodes &nodes) {
  std::vector<double> out(3 * nodes.number.size(), std::numeric_limits<double>::quiet_NaN());
  uint32_t n = 0;
  std::vector<dfm_body> bodies = listed<dfm_body>(dfm_body_pieces, nodes.body);
  bodies.insert(bodies.begin(), nodes.body);
  for (const dfm_body body : bodies) {
    const dfm_body_info info = got<dfm_body_info>(dfm_body_get_info, body);
    if (info.ntet == 0) continue;
    const uint32_t points = nodes.surface ? info.nsurfel : info.npoint;
    std::vector<double> u(3 * size_t(points));
    std::vector<uint32_t> origins(points);
    if (nodes.surface) {  // such a body is not cut
      need(dfm_debug_surface_displacements(body, points, u.data(), &n));
      std::iota(origins.begin(), origins.end(), 0u);
    } else {
      need(dfm_debug_displacements(body, points, u.data(), &n));
      need(dfm_body_origins(body, points, origins.data(), 0, nullptr));
    }
    for (size_t i = 0; i < points; ++i)
      if (const size_t to = 3 * size_t(origins[i]); to < out.size() && std::isnan(out[to]))
        std::copy_n(&u[3 * i], 3, &out[to]);  // points behind them are not in the file
  }
  return out;
}

void Outputs::write_nodes() {
  if (nodes_.empty()) return;
  make_folder(folder_ + "/nodes");
  for (const FileNodes &nodes : nodes_) {
    const std::vector<double> u = node_displacements(nodes);
    std::vector<uint32_t> order(nodes.number.size());
    for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::sort(order, [&](uint32_t i, uint32_t j) { return nodes.number[i] < nodes.number[j]; });
    std::string text = "node,ux,uy,uz\n";
    for (const uint32_t i : order) {
      if (std::isnan(u[3 * size_t(i)])) continue;
      text += std::to_string(nodes.number[i]);
      for (int k = 0; k < 3; ++k) text += "," + csv_number(u[3 * size_t(i) + k]);
      text += "\n";
    }
    write_whole(folder_ + "/nodes/" + nodes.name + ".csv", text);
  }
}

}  // namespace cli
