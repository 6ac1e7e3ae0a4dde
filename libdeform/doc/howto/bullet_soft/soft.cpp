// A soft body made for Bullet, taken over into a dfm_world: a cube of tetrahedra that hangs by its top. The
// guide is bullet_soft.md.
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <deform/bullet.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

static void must(dfm_status status) {
  if (status >= 0) return;
  std::fprintf(stderr, "%s\n", dfm_last_error());
  std::exit(1);
}

int main() {
  // ---- as you have it: 8 corners, 5 tetrahedra, the upper corners held
  btSoftBodyWorldInfo info;
  btVector3 corners[8];
  const btScalar masses[8] = {1, 1, 1, 1, 1, 1, 1, 1};
  for (int i = 0; i < 8; ++i)
    corners[i] = btVector3(i & 1 ? btScalar(0.2) : 0, i & 2 ? btScalar(0.2) : 0, i & 4 ? btScalar(0.2) : 0);
  btSoftBody body(&info, 8, corners, masses);
  const int cells[5][4] = {{0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}, {1, 2, 4, 7}};
  for (const auto &c : cells) body.appendTetra(c[0], c[1], c[2], c[3]);
  for (int i = 4; i < 8; ++i) body.setMass(i, 0);

  // ---- as it goes on
  dfm_context *context;
  dfm_world soft;
  dfm_body taken;
  must(dfm_context_create(nullptr, &context));
  const dfm_world_def world_def = dfm_world_def_default();
  must(dfm_world_create(context, &world_def, &soft));
  dfm_material_def gel = dfm_material_def_default();
  gel.density = 1000;  // kg/m3
  gel.young = 5e4;     // Pa
  gel.damping_mass = 5;
  dfm_body_def like = dfm_body_def_default();
  like.name = "cube";
  must(dfm_material_create(soft, &gel, &like.material));
  must(dfm_bullet_take_soft_body(context, soft, &body, &like, 0, &taken));

  uint32_t trouble = 0;
  for (int frame = 0; frame < 240; ++frame) must(dfm_world_step(soft, 1.0 / 60, &trouble));
  dfm_body_measure m{};
  m.size = sizeof m;
  must(dfm_body_get_measure(taken, &m));
  std::printf("a cube of %.1f kg hangs with its center at %.4f m\n", m.mass, m.com[2]);
  dfm_context_destroy(context);
  return std::fabs(m.mass - 8) < 1e-6 && m.com[2] < 0.1 && m.com[2] > 0.09 ? 0 : 1;
}
