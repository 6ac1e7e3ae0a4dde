#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "deform/bullet.h"
#include "opened.h"
#include "rigid_host/seated.h"

namespace dfm_bullet_detail {
namespace {

struct Arrays {
  std::vector<double> points;
  std::vector<uint32_t> tets, faces, held;
  Vec velocity;
};

Arrays arrays_of(const btSoftBody &body) {
  Arrays a;
  const btSoftBody::Node *const first = body.m_nodes.size() ? &body.m_nodes[0] : nullptr;
  const auto number = [&](const btSoftBody::Node *n) { return static_cast<uint32_t>(n - first); };
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    const btSoftBody::Node &n = body.m_nodes[i];
    const Vec x = from_bullet(n.m_x);
    a.points.insert(a.points.end(), {x.x, x.y, x.z});
    a.velocity = a.velocity + (1.0 / body.m_nodes.size()) * from_bullet(n.m_v);
    if (n.m_im == 0) a.held.push_back(static_cast<uint32_t>(i));
  }
  for (int i = 0; i < body.m_tetras.size(); ++i)
    for (const btSoftBody::Node *n : body.m_tetras[i].m_n) a.tets.push_back(number(n));
  for (int i = 0; i < body.m_faces.size(); ++i)
    for (const btSoftBody::Node *n : body.m_faces[i].m_n) a.faces.push_back(number(n));
  return a;
}

// The corners of the cell that holds a place: the one in which its least barycentric coordinate is largest.
std::array<uint32_t, 4> corners_around(const dfm_mesh_info &mesh, Vec place) {
  const uint32_t *best = mesh.tets;
  double deepest = -HUGE_VAL;
  for (uint32_t t = 0; t < mesh.ntet; ++t) {
    const uint32_t *const tet = mesh.tets + 4 * size_t{t};
    const auto volume = [&](int moved) {
      Vec x[4];
      for (int k = 0; k < 4; ++k) x[k] = k == moved ? place : load(mesh.points + 3 * size_t{tet[k]});
      return dot(x[1] - x[0], cross(x[2] - x[0], x[3] - x[0]));
    };
    const double least = std::min({volume(0), volume(1), volume(2), volume(3)}) / volume(-1);
    if (!(least > deepest)) continue;
    deepest = least;
    best = tet;
  }
  return {best[0], best[1], best[2], best[3]};
}

// Ends the meshes of a filled surface.
struct Filled {
  dfm_mesh_handle surface = 0, cells = 0;
  ~Filled() {
    if (cells) dfm_mesh_destroy(cells);
    if (surface) dfm_mesh_destroy(surface);
  }
};

dfm_status take(dfm_context *context, dfm_world world, const btSoftBody &body, const dfm_body_def &like,
                uint32_t cells, dfm_body *out) {
  Arrays a = arrays_of(body);
  dfm_body_def given = dfm_body_def_default(), def = given;
  std::memcpy(static_cast<void *>(&given), &like, std::min<size_t>(sizeof given, like.size));
  def.flags = given.flags;
  def.name = given.name;
  def.material = given.material;
  def.model = given.model;
  def.model_params = given.model_params;
  def.category = given.category;
  def.collides_with = given.collides_with;
  def.user = given.user;
  def.integrator = given.integrator;
  def.cookie = given.cookie;
  def.mass_scaling = given.mass_scaling;
  def.smooth = given.smooth;
  store(def.velocity, a.velocity);
  Filled filled;
  dfm_surface_def skin{};
  skin.size = sizeof skin;
  if (!a.tets.empty()) {
    def.points = a.points.data();
    def.tets = a.tets.data();
    def.npoint = static_cast<uint32_t>(a.points.size() / 3);
    def.ntet = static_cast<uint32_t>(a.tets.size() / 4);
  } else if (!a.faces.empty()) {
    TRY(dfm_mesh_create(context, static_cast<uint32_t>(a.points.size() / 3), a.points.data(),
                        static_cast<uint32_t>(a.faces.size() / 3), a.faces.data(), &filled.surface));
    TRY(dfm_mesh_fill(filled.surface, cells, &filled.cells));
    dfm_mesh_info info{};
    info.size = sizeof info;
    TRY(dfm_mesh_get_info(filled.cells, &info));
    def.points = info.points;
    def.tets = info.tets;
    def.cell_share = info.share;
    skin.npoint = static_cast<uint32_t>(a.points.size() / 3);
    skin.ntriangle = static_cast<uint32_t>(a.faces.size() / 3);
    skin.points = a.points.data();
    skin.triangles = a.faces.data();
    skin.coupling = DFM_COUPLING_BARYCENTRIC;
    def.surface = &skin;
    def.npoint = info.npoint;
    def.ntet = info.ntet;
    std::vector<uint32_t> corners;  // which hold the nodes of the surface
    for (const uint32_t node : a.held) {
      const auto around = corners_around(info, load(&a.points[3 * size_t{node}]));
      corners.insert(corners.end(), around.begin(), around.end());
    }
    a.held = std::move(corners);
  } else {
    return failed(DFM_E_ARG,
                  "the btSoftBody has neither tetrahedra nor faces; the library needs a volume, which ropes "
                  "and bodies made only of links do not have");
  }
  std::vector<uint8_t> fixed(def.npoint);
  for (const uint32_t point : a.held) fixed[point] = 7;
  def.fixed = fixed.data();
  return dfm_body_create(world, &def, out);
}

}  // namespace
}  // namespace dfm_bullet_detail

using namespace dfm_bullet_detail;

dfm_status dfm_bullet_take_soft_body(dfm_context *context, dfm_world world, const btSoftBody *body,
                                     const dfm_body_def *like, uint32_t cells, dfm_body *out) {
  try {
    if (!context || !body || !like || !out)
      return missing(!context ? "context" : !body ? "body" : !like ? "like" : "out");
    return take(context, world, *body, *like, cells, out);
  } catch (const std::bad_alloc &) {
    return dfm_fail(DFM_E_NOMEM, "bullet: out of memory");
  }
}
