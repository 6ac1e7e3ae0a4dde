// Rigid hosts by name: those of dfm_rigid_host_register(), and the builtin one.
#pragma once
#include <string>

#include "deform/rigid.h"

namespace dfm {

const dfm_rigid_host &builtin_host();  // builtin.cpp

void register_host(const std::string &name, const dfm_rigid_host &table);  // throws Error
// By name; throws Error(DFM_E_ARG), which suggests the nearest name.
dfm_rigid_host find_host(const std::string &name);

// Volume (m3) and moments (kg m2, about its own axes) of a solid of uniform density.
double solid_volume(const dfm_rigid_def &def);
void solid_inertia(const dfm_rigid_def &def, double out[3]);

}  // namespace dfm
