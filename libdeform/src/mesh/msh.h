// Reader of gmsh files: sections and elements are the same in MSH 2.0 to 2.2 (read_msh22.cpp), 4.0 and 4.1
// (read_msh4.cpp).
#pragma once
#include <cstdint>

#include "mesh/cells.h"
#include "mesh/numbers.h"
#include "mesh/raw_mesh.h"

namespace dfm {

constexpr const char *kConvertMsh =
    "convert it first: gmsh -3 -save_all -format msh41 -order 1 FILE -o OUT.msh";

class MshReader {
 public:
  // wide: counts of version 4, and numbers of 4.1, have 8 bytes, not 4
  MshReader(Cursor &in, RawMesh &out, double version, bool wide)
      : in_(in),
        out_(out),
        four_(version >= 4.0),
        first_four_(version == 4.0),
        wide_(wide),
        nodes_(*out.memory, "node"),
        entities_(*out.memory) {}
  void run();

 private:
  struct Entity {  // of the geometry
    int32_t dimension, tag;
    uint32_t group;
    bool operator<(const Entity &o) const {
      return std::pair(dimension, tag) < std::pair(o.dimension, o.tag);
    }
  };
  // A gmsh element type; points 0: not known.
  struct Element {
    uint32_t points;
    int32_t dimension;
  };
  static constexpr int64_t kTet = 4;

  void read_physical_names();
  // Elements come one by one: cells of mesh/cells.h, triangles and quadrangles (cut) are kept, points and
  // lines passed over (their points join their group), other volume cells refused, and curved faces where the
  // file has nothing straight.
  void begin_elements(int64_t type);  // checks that elements of this type can be taken
  void add_element(uint32_t group);   // of nodes tags_
  double real(const char *what) { return in_.real(Number::f64, what); }
  int32_t number(const char *what) { return in_.in_32_bits(in_.integer(Number::i32, what), what); }

  void read_nodes_22(bool parametric);
  void read_elements_22();

  int64_t size(const char *what);
  Number size_type() const { return wide_ ? Number::u64 : Number::u32; }
  int64_t tag(const char *what) { return first_four_ ? number(what) : size(what); }  // of node and element
  size_t tag_bytes() const { return !in_.binary ? 2 : first_four_ ? 4 : bytes_of(size_type()); }
  void read_entities_4(bool partitioned);
  void read_nodes_4();
  void read_elements_4();
  uint32_t group_of(int32_t dimension, int32_t tag) const;

  Cursor &in_;
  RawMesh &out_;
  bool four_, first_four_, wide_;
  Numbers nodes_;
  Array<Entity> entities_;
  Element element_{0, 0};           // of begin_elements()
  const CellKind *cell_ = nullptr;  // if it is a volume cell
  bool curved_face_ = false;        // a face of second order
  int64_t tags_[125];               // as many as any element has
  uint64_t curved_ = 0;             // faces of second and higher order
};

}  // namespace dfm
