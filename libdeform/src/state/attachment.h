// Points of a body's surface that are held at places of something else (deform/attach.h): the lasting state.
// step/solve/attach.cpp makes bonds from it (contact/bond.h).
#pragma once
#include <cstdint>
#include <vector>

#include "math/vec3.h"

namespace dfm {

inline constexpr uint32_t kAnchors = 4;  // surfels of the other body that carry a place

struct Attachment {
  uint32_t number = 0;                             // among the attachments of the body
  uint64_t body = 0, to = 0;                       // ids
  uint32_t obstacle = 0;                           // 1: `to` is an obstacle or a rigid body
  uint32_t flags = 0;                              // DFM_ATTACH_*
  double stiffness = 0, damping = 0, release = 0;  // N/m, N s/m; N
  std::vector<uint32_t> surfels;                   // [n], ascending
  std::vector<double> place;    // obstacle: [n,3] m, in its frame; of a rigid body from its center of mass
  std::vector<uint32_t> node;   // body: [n,kAnchors] surfels of it
  std::vector<double> weight;   // body: [n,kAnchors], a place's sum to 1
  std::vector<double> impulse;  // [n,3] N s on the surfels in the last sub-step
  double h = 0;                 // s, of that sub-step; 0: none yet
  Vec3 total;                   // N s since creation
  bool released = false;        // no longer holds; removed before the next step
  bool parted = false;          // and what it held may touch again
  Vec3 sum() const {
    Vec3 p;
    for (size_t i = 0; i < impulse.size(); i += 3) p += load3(&impulse[i]);
    return p;
  }
};

}  // namespace dfm
