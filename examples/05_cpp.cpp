// The same in C++: the balls of 01_hello with handles that destroy what they own, arrays as spans, and errors
// in both forms: as exceptions, and as a value where a failure is an expected result.
#include <cstdio>
#include <deform/deform.hpp>

namespace {

deform::Body drop(const deform::World &world, const deform::Mesh &mesh, const char *name, deform::Vec3 at) {
  deform::BodyDef def;
  def.set_mesh(mesh);
  def.name = name;
  for (int k = 0; k < 3; ++k) def.pose.position[k] = at[k];
  return world.add_body(def);
}

int run() {
  const auto context = deform::Context::make();
  const auto world = context.make_world();
  const auto mesh = context.make_tets("ball", {0.1}, 500);
  world.add_obstacle(deform::ObstacleDef{});  // the plane z = 0
  const deform::Body lower = drop(world, mesh, "lower", {0, 0, 0.11});
  const deform::Body upper = drop(world, mesh, "upper", {0.01, 0, 0.31});
  world.add_friction("lower", "upper", "karnopp", deform::Params({{"mu", 0.8}}));

  // The same world, errors as values: asking for a law that may not be there is no reason to unwind.
  const deform::values::World ask(world.get());
  if (const auto r = ask.add_friction("lower", "upper", "velcro"); !r)
    std::printf("no such law: %s\n", deform::status_name(r.status()));

  for (int i = 0; i < 500; ++i)
    if (!world.step(1e-3)) return 1;  // discarded: too many sub-steps would have been needed
  dfm_contact room[512];
  const uint32_t n = world.contacts(room);
  double on_upper = 0;
  for (const dfm_contact &c : std::span(room).first(n))
    if (c.body_a == upper.get() || c.body_b == upper.get()) on_upper += c.fn;
  std::printf("%u contacts, %.3f N between the balls, lower at %.4f m\n", n, on_upper,
              lower.measure().com[2]);
  return on_upper > 0 ? 0 : 1;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const deform::Error &e) {  // the library's own sentence
    std::printf("%s: %s\n", deform::status_name(e.status()), e.what());
    return 1;
  }
}
