// The stages that the method `rollback` has for itself.
#pragma once
#include <cstdint>
#include <memory>

#include "step/method.h"

namespace dfm::rollback {

std::unique_ptr<MethodBuffers> make_buffers(const Memory &memory);
void stage_lagged(World &w, StepContext &step);
bool stage_rollback(World &w, StepContext &step, uint32_t *trouble);

}  // namespace dfm::rollback
