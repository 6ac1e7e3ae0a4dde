// What MSH 2.2 and 4.1 share: element types, node numbers, and the element sink.
#pragma once
#include <cstdint>

#include "mesh/raw_mesh.h"

namespace dfm {

constexpr const char *kConvertMsh =
    "convert it first: gmsh -3 -save_all -format msh41 -order 1 FILE -o OUT.msh";

// Points and dimension of a gmsh element type; points 0: not known.
struct MshElement {
  uint32_t points;
  int32_t dimension;
};
MshElement msh_element(int64_t type);
constexpr int64_t kMshTet = 4;

// Node numbers of the file to positions. Numbers may have gaps and come in any order.
class NodeNumbers {
 public:
  explicit NodeNumbers(const Memory &m)
      : tags_(HookAllocator<int64_t>(m)), order_(HookAllocator<uint32_t>(m)) {}
  void reserve(size_t n) { tags_.reserve(n); }
  void add(int64_t tag) { tags_.push_back(tag); }
  size_t size() const { return tags_.size(); }
  void finish(const Cursor &in);                       // refuses a number given twice
  uint32_t find(const Cursor &in, int64_t tag) const;  // refuses an unknown number

 private:
  Array<int64_t> tags_;    // by position, then ascending after finish()
  Array<uint32_t> order_;  // position of each ascending number; empty where they ascend in the file already
};

// Takes elements one by one: keeps tetrahedra, triangles and quadrangles (cut), passes over points and
// lines (their points join their group), refuses other volume cells, and curved faces where the file has
// nothing straight.
class ElementSink {
 public:
  ElementSink(RawMesh &out, const NodeNumbers &nodes) : out_(out), nodes_(nodes) {}
  // Checks that elements of this type can be taken; returns how many points each has.
  uint32_t begin(const Cursor &in, int64_t type);
  void add(const Cursor &in, uint32_t group, const int64_t *tags);
  void finish(const Cursor &in) const;

 private:
  RawMesh &out_;
  const NodeNumbers &nodes_;
  MshElement element_{0, 0};
  uint64_t curved_ = 0;  // faces of second and higher order
};

constexpr uint32_t kMaxElementPoints = 125;

void read_msh22(Cursor &in, RawMesh &out);
void read_msh41(Cursor &in, RawMesh &out, size_t size_bytes);

// Moves past "$NAME" content that is not used, to after "$EndNAME".
void skip_section(Cursor &in, std::string_view name);
void read_physical_names(Cursor &in, RawMesh &out);
int32_t msh_int(const Cursor &in, int64_t value, const char *what);

}  // namespace dfm
