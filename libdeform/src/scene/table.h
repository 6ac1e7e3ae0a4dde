// The tables that a scene names, CSV files of numbers: each reader throws with file and line.
#pragma once
#include "scene/select.h"

namespace dfm::scene {

// Values of a field for each cell of the mesh, [ntet,width].
std::vector<double> read_field(const std::string &path, const FieldFile &field, const BodyMesh &mesh);

std::string columns_of(uint32_t width);  // the header of such a file, without "cell"

// Held components and forces by the file's node numbers.
inline constexpr const char *kNodalHeader = "node,fixx,fixy,fixz,fx,fy,fz";
struct NodalRow {
  uint32_t point;
  uint8_t axes;
  double force[3];
};
std::vector<NodalRow> read_nodal(const std::string &path, const BodyMesh &mesh);
// [npoint] axes along which the body's fixes and its table hold each point.
std::vector<uint8_t> held_axes(const Body &body, const BodyMesh &mesh, const std::vector<NodalRow> &nodal,
                               const std::string &file);

inline constexpr const char *kStateHeader = "node,x,y,z,vx,vy,vz";
// [npoint,3] m and m/s, in the world, from a file that names every node once.
struct StartState { std::vector<double> x, v; };
StartState read_start_state(const std::string &path, const BodyMesh &mesh);

// A recorded hand (reference/scenes.md, "tools"): the tool's keys; those of the opening where it has jaws.
void read_hand(const std::string &path, Tool &tool);

}  // namespace dfm::scene
