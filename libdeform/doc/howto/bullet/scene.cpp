// Soft bodies in a Bullet scene: a plate and a crate upon it, moved by Bullet, come down on a soft cushion
// that libdeform moves. The guide is bullet.md; what the scene had before stands between "Bullet" marks.
#include <deform/bullet.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

static void must(dfm_status status) {
  if (status >= 0) return;
  std::fprintf(stderr, "%s\n", dfm_last_error());
  std::exit(1);
}

// A block of gel, 0.3 x 0.3 x 0.1 m, that lies where the plate will land.
static dfm_body make_cushion(dfm_context *context, dfm_world soft) {
  dfm_mesh_handle mesh;
  dfm_mesh_info info{};
  dfm_body body;
  dfm_body_def def = dfm_body_def_default();
  dfm_material_def gel = dfm_material_def_default();
  const double size[3] = {0.3, 0.3, 0.1};
  info.size = sizeof info;
  gel.young = 3e4;
  gel.damping_mass = 4;
  gel.damping_stiffness = 4e-3;
  must(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 900, &mesh));
  must(dfm_mesh_get_info(mesh, &info));
  def.points = info.points;
  def.tets = info.tets;
  must(dfm_material_create(soft, &gel, &def.material));
  def.name = "cushion";
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  def.pose.position[0] = def.pose.position[1] = -0.15;
  def.pose.position[2] = 1e-3;
  must(dfm_body_create(soft, &def, &body));
  return body;
}

int main() {
  // ---- Bullet: begin
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(btVector3(0, 0, btScalar(-9.81)));
  btStaticPlaneShape ground(btVector3(0, 0, 1), 0);
  btBoxShape plate_shape(btVector3(btScalar(0.125), btScalar(0.125), btScalar(0.01)));
  btBoxShape crate_shape(btVector3(btScalar(0.05), btScalar(0.05), btScalar(0.05)));
  const auto add = [&](btScalar mass, btCollisionShape &shape, btScalar height) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape.calculateLocalInertia(mass, inertia);
    auto *const body = new btRigidBody(mass, nullptr, &shape, inertia);
    body->setCenterOfMassTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 0, height)));
    world.addRigidBody(body);
    return body;
  };
  btRigidBody *const floor = add(0, ground, 0);
  btRigidBody *const plate = add(2, plate_shape, btScalar(0.14));
  btRigidBody *const crate = add(1, crate_shape, btScalar(0.21));
  // ---- Bullet: end

  dfm_context *context;
  dfm_world soft;
  dfm_bullet bullet;
  dfm_rigid rigid;
  must(dfm_context_create(nullptr, &context));
  const dfm_world_def world_def = dfm_world_def_default();
  must(dfm_world_create(context, &world_def, &soft));
  make_cushion(context, soft);
  dfm_bullet_def def = dfm_bullet_def_default();
  def.world = &world;
  must(dfm_bullet_attach(soft, &def, &bullet));

  must(dfm_bullet_rigid(bullet, plate, &rigid));  // the handle of the plate in reports
  constexpr int kRate = 60, kSeconds = 4;
  double carried = 0;
  for (int frame = 1; frame <= kSeconds * kRate; ++frame) {
    world.stepSimulation(btScalar(1.0 / kRate), 10, btScalar(1.0 / 240));  // as before
    must(dfm_bullet_last_tick(bullet, nullptr));
    double force[3], moment[3];
    must(dfm_rigid_contact_wrench(rigid, force, moment));
    if (frame > (kSeconds - 1) * kRate) carried += force[2] / kRate;
    if (frame % kRate == 0)
      std::printf("t %d s: plate at %.4f m, crate at %.4f m\n", frame / kRate,
                  double(plate->getCenterOfMassPosition().z()), double(crate->getCenterOfMassPosition().z()));
  }
  std::printf("the cushion carries %.3f N of %.3f N\n", carried, 3 * 9.81);

  must(dfm_bullet_detach(bullet));  // before either world goes
  dfm_context_destroy(context);
  for (btRigidBody *body : {floor, plate, crate}) {
    world.removeRigidBody(body);
    delete body;
  }
  return std::fabs(carried - 3 * 9.81) < 0.01 * 3 * 9.81 ? 0 : 1;
}
