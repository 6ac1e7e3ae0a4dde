#include "interrupt.h"

#include <csignal>

#include "leaving.h"

namespace cli {
namespace {

volatile std::sig_atomic_t came = 0;

void on_signal(int) {
  came = 1;
  expect_return();
  if (const dfm_world world = stepping) dfm_world_interrupt(world);
}

}  // namespace

void catch_signals() {
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return came != 0; }

}  // namespace cli
