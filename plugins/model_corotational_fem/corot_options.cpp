// Converts parameters and fields by cell to the arrays that the passes read. Unused arrays stay empty.
#include <stdio.h>

#include "../model_common/fibers.h"
#include "../model_common/params.h"
#include "../model_common/rotation.h"
#include "corot_body.h"

namespace corot {

namespace {

Rotate rotate_by(uint32_t choice) {
  return choice == kQr    ? model::rotation::gram_schmidt
         : choice == kSvd ? model::rotation::by_singular_values
                          : model::rotation::nearest;
}

}  // namespace

void Body::take_fields(const dfm_mesh &m) {
  model::take_fields(host, kId, kParams, kParamCount, m, field, [](uint32_t, double) { return true; });
}

double Body::largest_of(Param which) const { return model::largest_of(field[which], params[which], ncell); }

bool Body::given(Param which) const { return largest_of(which) != kAuto; }

model::Fiber Body::fiber_at(uint32_t c) const {
  return model::fiber_of_cell(host, kId, c, at(kYoung, c), at(kPoisson, c), at(kYoungAlong, c),
                              at(kPoissonAlong, c), at(kShearAlong, c));
}

void Body::make_room(Room &room) const {
  if (has_fibers() && choice(kEnergy) != kLinear)
    model::refuse(
        host, kId,
        "anisotropy works with the energy corotational only; choose it, or leave the constants along "
        "the axis at auto");
  if (nodal() && (has_fibers() || choice(kEnergy) != kLinear))
    model::refuse(
        host, kId,
        "locking nodal works with the energy corotational and without anisotropy only; choose these, or "
        "locking none");
  if (!plastic() && largest_of(kYield) > 0) model::refuse(host, kId, "%s", model::plastic::kMadeWithout);
  if (plastic() && (has_fibers() || choice(kEnergy) != kLinear))
    model::refuse(host, kId, "%s", model::plastic::kNoFibers);
  if (has_fibers()) room.fiber.create(host, groups);
  if (has_dampers()) {
    room.damp.create(host, lanes());
    room.damp_value.create(host, lanes());
  }
  if (largest_of(kDampingMass) > 0) {
    room.point_drag.create(host, npoint);
    room.around.create(host, npoint);
  }
  room.next.create(host, npoint);
  room.blocks.create(host, 10 * size_t(ncell));
  for (uint32_t c = 0; has_fibers() && c < ncell; ++c) (void)fiber_at(c);
}

void Body::fill_material(Room &room) {
  fiber.swap(room.fiber);
  damp.swap(room.damp);
  damp_value.swap(room.damp_value);
  for (size_t n = 0; n < lanes(); ++n) {
    Group &g = group[n / kGroup];
    const uint32_t lane = uint32_t(n % kGroup), c = cell_id[n];
    const double v = c == kNone ? 0 : volume[c];
    const uint32_t like = c == kNone ? 0 : c;
    if (!damp.empty()) damp[n] = c == kNone ? 0 : at(kDampingStiffness, c);
    if (plastic()) {
      PlasticGroup &flow = plastic_group[n / kGroup];
      const model::plastic::Yield own =
          model::plastic::yield_of(at(kYield, like), at(kHardening, like), at(kPlasticLimit, like), v);
      flow.yield[lane] = own.stress;
      flow.hardening[lane] = own.hardening;
      flow.limit[lane] = own.limit;
    }
    if (!has_fibers()) {
      const model::Lame lame = model::lame_of(at(kYoung, like), at(kPoisson, like));
      g.mu2[lane] = 2 * lame.mu * v;
      g.lambda[lane] = lame.lambda * v;
      continue;
    }
    const model::Fiber constants = fiber_at(like);
    const double *a = axis_of(like);
    const double length = __builtin_sqrt((a[0] * a[0] + a[1] * a[1]) + a[2] * a[2]);
    FiberGroup &out = fiber[n / kGroup];
    g.mu2[lane] = 2 * constants.mu * v;
    g.lambda[lane] = constants.lambda * v;
    for (int k = 0; k < 3; ++k) out.axis[k][lane] = a[k] / length;
    out.alpha[lane] = constants.alpha * v;
    out.beta[lane] = constants.beta * v;
    out.shear[lane] = 2 * (constants.mu_along - constants.mu) * v;
    out.most[lane] = model::largest_modulus(constants) * v;
    out.young[lane] = at(kYoung, like) * v;
  }
  size_t groups_at = 0;
  for (uint32_t b = 0; b < nblock; ++b) {
    block[b].fiber = fiber.empty() ? nullptr : fiber.data() + groups_at;
    block[b].damp = damp.empty() ? nullptr : damp.data() + kGroup * groups_at;
    block[b].damp_value = damp.empty() ? nullptr : damp_value.data() + kGroup * groups_at;
    block[b].energy = choice(kEnergy);
    block[b].rotate = rotate_by(choice(kRotation));
    block[b].nodal = nodal();
    block[b].plastic = plastic() ? plastic_group.data() + groups_at : nullptr;
    block[b].cell = cell_id.data() + kGroup * groups_at;
    block[b].collapse = choice(kEnergy) == kLinear ? params[kCollapse] : 0;
    block[b].rotate_all = choice(kRotation) != kPolar;
    groups_at += block[b].groups;
  }
}

// Drag by cell is taken over the volume around a point.
void Body::fill_drag(Room &room) {
  point_drag.swap(room.point_drag);
  if (point_drag.empty()) return;
  for (uint32_t c = 0; c < ncell; ++c)
    for (int a = 0; a < 4; ++a) {
      const uint32_t i = cells[4 * size_t(c) + a];
      point_drag[i] += volume[c] * at(kDampingMass, c);
      room.around[i] += volume[c];
    }
  for (uint32_t i = 0; i < npoint; ++i)
    point_drag[i] = room.around[i] > 0 ? point_drag[i] / room.around[i] * mass[i] : 0;
}

void Body::find_effects() {
  size_t n = 0;
  active_effects[n++] = "volume";
  if (has_dampers() || !point_drag.empty()) active_effects[n++] = "damping";
  active_effects[n++] = "large_rotation";
  if (has_fibers()) active_effects[n++] = "anisotropy";
  if (largest_of(kYield) > 0) active_effects[n++] = "deform.plasticity";
  active_effects[n] = nullptr;
}

const char *Body::idle(Param which) const {
  if ((which == kHardening || which == kCreep || which == kPlasticLimit) && !(largest_of(kYield) > 0))
    return model::plastic::kIdle;
  if (which == kCollapse && choice(kEnergy) != kLinear) return "energy is not corotational";
  if (which == kRotation && choice(kEnergy) != kLinear && !has_dampers())
    return "energy is not corotational and there are no dampers";
  if (which == kAxis && !has_fibers()) return model::kNoAxis;
  return nullptr;
}

// All or nothing: steps that may fail come first.
void Body::apply_params(const double *values) {
  Room room;
  model::try_params(params, values, [&] { make_room(room); });
  fill_material(room);
  fill_drag(room);
  if (nodal()) find_bulk();
  find_rows(room);
  find_effects();
}

}  // namespace corot
