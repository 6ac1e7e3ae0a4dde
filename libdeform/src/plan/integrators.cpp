#include "plan/integrators.h"

#include <algorithm>

namespace dfm {
namespace {

// Explicit time keeps motion that implicit time damps where bodies touch, and TR-BDF2 takes twice the work
// that is counted where they do not: implicit time has to be so many times cheaper.
constexpr double kCheaper = 4;

struct Cost {
  double substeps = 1;  // sub-steps that the explicit bodies need
  double work = 0;      // of one
};

void add(Cost &cost, const IntegratorOption &b, bool implicit) {
  cost.work += implicit ? b.implicit_work * b.work : b.work;
  if (!implicit) cost.substeps = std::max(cost.substeps, b.substeps);
}

// A body that alone would be explicit is so beside any others.
bool stays(const IntegratorOption &b) {
  return !b.open || b.implicit_work == 0 || !(b.substeps > kCheaper * b.implicit_work);
}

}  // namespace

// Among the bodies that would be implicit if each were the only one, makes the stiffest ones so where that is
// cheaper for the world, and further ones only if that is cheaper by another factor of four.
void choose_integrators(std::vector<IntegratorOption> &bodies) {
  Cost rest;  // bodies whose integrator is fixed
  std::vector<size_t> order;
  for (size_t i = 0; i < bodies.size(); ++i) {
    if (stays(bodies[i])) add(rest, bodies[i], bodies[i].implicit);
    else order.push_back(i);
  }
  std::sort(order.begin(), order.end(), [&](size_t i, size_t j) {
    const double a = bodies[i].substeps, b = bodies[j].substeps;
    return a > b || (a == b && i < j);
  });
  // of those from k on explicitly, by suffix
  std::vector<Cost> after(order.size() + 1);
  for (size_t k = order.size(); k-- > 0;) {
    after[k] = after[k + 1];
    add(after[k], bodies[order[k]], false);
  }
  const auto total = [&](size_t k, double implicit) {
    return std::max(rest.substeps, after[k].substeps) * (rest.work + after[k].work + implicit);
  };
  double most = total(0, 0) / kCheaper, implicit = 0;
  size_t chosen = 0;
  for (size_t k = 0; k < order.size(); ++k) {
    const IntegratorOption &b = bodies[order[k]];
    implicit += b.implicit_work * b.work;
    if (const double cost = total(k + 1, implicit); cost < most) {
      most = cost / kCheaper;
      chosen = k + 1;
    }
  }
  for (size_t k = 0; k < order.size(); ++k) bodies[order[k]].implicit = k < chosen;
}

}  // namespace dfm
