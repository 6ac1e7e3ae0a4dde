// Impact times for the roll-back (doc/concepts/rollback.md): the time at which two listed features, moving on
// straight lines over the sub-step, first reach their rest distance, with the places and the normal at that
// time.
//
// Features that are apart touch when their true distance falls to d_c, found conservatively: never late.
// Features that rest at d_c (or nearer) touch at t = 0 if they approach; if they separate, only when they
// return to half of their distance. Features that have crossed at the start may separate.
#pragma once
#include <cstdint>
#include <span>

#include "contact/contact_set.h"
#include "geometry/views.h"

namespace dfm::rollback {

struct ImpactHit {
  double t;       // fraction of the sub-step; above 1: never
  uint32_t part;  // of an obstacle: its face, edge or corner, as contacts number them; else 0
  // weights of the triangle's corners, or places on edge a and edge b; 1 for a surfel that
  // meets a closed form
  double at[3];
  double start;      // m, distance at the start
  double normal[3];  // unit, from b to a, at t
  double point[3];   // m, midway, at t
};

class ImpactQuery {
 public:
  // Views by slot; surface->x and surface->v are start and velocity, obstacles stand still. h in s;
  // touch: d_c, m.
  ImpactQuery(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles, double h,
              double touch);

  // fraction: by slot, [nsurfel] share of its displacement h v for each surfel; empty: all of it. Re-entrant.
  ImpactHit first(const Candidate &c, std::span<const double *const> fraction) const;
  // World-wide surfel numbers of both features; returns how many.
  uint32_t nodes(const Candidate &c, uint32_t out[4]) const;
  // The hit as a contact, with area and key (patch as last part of it); key unique among contacts of
  // different features of the first side.
  ContactPoint contact(const Candidate &c, const ImpactHit &hit) const;

 private:
  // One corner: a surfel of a body, or a fixed point.
  struct Corner {
    uint32_t slot, surfel;
    Vec3 still;
  };
  // A point and a triangle, or two edges; the first feature is body a's unless `turned`. round: around
  // the second one.
  struct Features {
    Corner corner[4];
    bool edges, turned;
    uint32_t part;
    double round;
  };

  Corner surfel(uint32_t slot, uint32_t s) const { return {slot, s, {}}; }
  Corner still(Vec3 p) const { return {kNone, 0, p}; }
  Vec3 start(const Corner &c) const;
  Vec3 way(const Corner &c, std::span<const double *const> fraction) const;
  template <class F>
  // calls f(Features) for all feature pairs of the candidate except a surfel against a closed form
  void each(const Candidate &c, F &&f) const;
  void mesh_features(const Candidate &c, const Surface &mesh, Features &f) const;
  void against_shape(const Candidate &c, std::span<const double *const> fraction, ImpactHit &best) const;
  void against(const Features &f, std::span<const double *const> fraction, ImpactHit &best) const;

  std::span<const BodyView> bodies_;
  std::span<const ObstacleView> obstacles_;
  double h_, touch_;
};

}  // namespace dfm::rollback
