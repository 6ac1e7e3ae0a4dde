// Rigid hosts by name: what dfm_rigid_host_register() has taken, and the one that comes with the library.
#pragma once
#include <string>
#include <vector>

#include "deform/rigid.h"

namespace dfm {

const dfm_rigid_host &builtin_host();  // builtin.cpp

void register_host(const std::string &name, const dfm_rigid_host &table);  // throws Error
// By name; throws Error(DFM_E_ARG) that names the nearest one.
dfm_rigid_host find_host(const std::string &name);

// Of a solid of uniform density: m3; kg m2 about its own axes.
double solid_volume(const dfm_rigid_def &def);
void solid_inertia(const dfm_rigid_def &def, double out[3]);

}  // namespace dfm
