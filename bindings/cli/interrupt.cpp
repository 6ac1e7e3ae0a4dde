#include "interrupt.h"

#include <csignal>

#include "leaving.h"
#include "system.h"

namespace cli {
namespace {

volatile std::sig_atomic_t came = 0;

void on_signal(int) {
  came = 1;
  expect_return();
  if (const dfm_world world = stepping) dfm_world_interrupt(world);
}

}  // namespace

void catch_signals() { os::on_end_signals(on_signal); }

bool interrupted() { return came != 0; }

}  // namespace cli
