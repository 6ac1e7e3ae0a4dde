// What share.py counts: steps of load.h, the first ones before the mark that dfm_world_rigids is.
#include "load.h"

int main() {
  test::Engine engine;
  test::fill_load(engine);
  engine.run(0.03);
  uint32_t bodies = 0;
  test::ok(dfm_world_rigids(engine.soft, 0, nullptr, &bodies));
  engine.run(0.03);
  return bodies == 100 && !::testing::Test::HasFailure() ? 0 : 1;
}
