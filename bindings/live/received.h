// What packets of a stream have told: the format of doc/reference/stream.md, read. Bytes of any origin may
// come: what is not of the format is passed over, and memory is bounded.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace live {

class Received {
 public:
  // A body; or an obstacle or rigid body, which is in the axes of its pose and has no displacements.
  struct Mesh {
    std::string name;
    uint32_t shape = 0, frame = 0;  // frame: when it was told
    size_t points = 0, faces = 0;   // that it has when it is complete
    // Its chunks until as much has come as it needs: memory is bounded by that, whatever was announced.
    std::vector<unsigned char> waiting;
    bool filled = false;           // they are in the lists below
    std::vector<float> base;       // [n,3] m
    std::vector<double> moved, x;  // [n,3] m; x: where the points are
    std::vector<uint32_t> triangles;
    size_t missing = 0;            // values that have not come yet
    std::unique_ptr<Mesh> before;  // with the triangles of before, until the new ones are complete
    bool in_packet = false;        // told of in the packet that is being read
    bool rigid = false;            // all below is of such a one
    uint32_t kind = 0;             // DFM_SHAPE_*
    bool sensor = false, placed = false;
    float radius = 0, half_length = 0, half_size[3] = {0, 0, 0};
    double position[3] = {0, 0, 0}, rotation[4] = {0, 0, 0, 1};
    // nullptr: there is nothing whole to draw.
    const Mesh *drawn() const { return missing == 0 ? this : before.get(); }
  };
  struct Contact {
    float point[3], force[3];
    uint32_t sticks;
  };

  // Packets, one behind the other. False: there is something else among them; what stands before it is taken.
  bool read(const unsigned char *bytes, size_t n);
  const std::map<uint32_t, Mesh> &meshes() const { return meshes_; }
  const std::vector<Contact> &contacts() const { return contacts_; }
  bool present(uint32_t number) const { return present_.contains(number); }
  double time() const { return time_; }      // s, of the newest frame
  uint32_t frame() const { return frame_; }  // its number

 private:
  class Chunk;
  void packet(const unsigned char *bytes, size_t n);
  void chunks(const unsigned char *bytes, size_t n);
  void chunk(const unsigned char *tag, const Chunk &c);
  void body(const Chunk &c);
  void thing(const Chunk &c);
  void set_triangles(const Chunk &c, Mesh fresh, size_t name);
  void base(const Chunk &c);
  void triangles(const Chunk &c);
  void list(const Chunk &c);
  void poses(const Chunk &c);
  void surface(const Chunk &c);
  void contacts(const Chunk &c);
  Mesh *mesh(const Chunk &c);
  bool fills(Mesh &m, const char *tag, const Chunk &c);
  void complete(Mesh &m);
  template <class F>
  void forget(F gone);  // the meshes for which gone(number, mesh)

  std::map<uint32_t, Mesh> meshes_;
  std::map<uint32_t, uint32_t> present_, listing_;  // listing_: a list of which a part may not have come yet
  std::vector<Contact> contacts_;
  double time_ = 0;
  uint32_t frame_ = 0, packet_frame_ = 0, listed_ = 0;  // of the packet that is read; of listing_
  uint32_t part_ = 0;                                   // number of the packet that is read
  std::set<uint32_t> parts_;  // packets of the frame of which the contacts have come
  bool begun_ = false;
  size_t held_ = 0;  // of the bound of memory
};

}  // namespace live
