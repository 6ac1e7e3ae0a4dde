// May a surface touch itself in this sub-step? For bodies whose self contact is on only while
// it may ("auto").
//
// Two features without a common corner, surfel and triangle or two edges, that rest D apart count as near
// where their distance d satisfies
//
//     d < max(l + m, min(r, 0.6 D))        l = min(2 d_c, 0.6 D), r: the depth from which narrow/ leads back
//                                          what is through
//     before the solve    m = 2 h |v|      v: the largest relative velocity of their corners
//     after it            m = min(h |w|, 2 h (s + c))
//
// with w as v, but as the solve left it, s the largest speed beyond the rigid motion that fits best, and c
// the most by which the solve has changed the velocity of a surfel. Pairs with D < d_c / 100 lie on
// themselves and make no contacts (narrow/self_contact.cpp).
//
// Proof that nothing is missed while no pair is near. A contact is made of a pair with d < 2 d_c + 2 h |v|,
// and rests at o = min(d_c, D / 2) < l. A pair that is not near is beyond that reach, or l = 0.6 D and its
// distance stays above 0.6 D > o in the motion without contact: it carries nothing. After the solve features
// move on straight lines. Their distance falls by h |w| at most, and by 2 h (s + c) at most since the rigid
// part of such a motion brings nothing together. So it stays above l > 0 to the end of the sub-step: the pair
// does not touch, and a surface that does not cross itself at the start does not at the end, as two features
// would have to pass through d = 0 first. (A surface that crosses itself at the start is led back where a
// feature is less than r deep in a triangle: d < r.)
//
// The result is a function of positions, velocities and h. The data kept between calls only save work: most
// sub-steps compare one number with the slack of all pairs at the last full check, which decreases by no more
// than the relative motion of the surfels since.
#pragma once
#include <functional>

#include "broad/self_list.h"

namespace dfm {

class SelfWatch {
 public:
  // The list belongs to the body and is updated if the slack does not decide.
  SelfWatch(const Memory &memory, const Surface &surface, const SelfRest &rest, SelfList &list);
  // speed: m/s, no surfel is faster; infinite: not known.
  bool near(double h, double offset, double speed);
  // After near() of the same sub-step. change: m/s, c above; velocity: of a surfel after the solve.
  bool meets(double h, double offset, double change, const std::function<Vec3(uint32_t surfel)> &velocity);

 private:
  // m = min(time * |relative velocity|, most), and no more than fall for any pair.
  struct SelfQuery {
    double time, most, fall;
    const std::function<Vec3(uint32_t surfel)> &velocity;
  };
  bool any_near(double offset, const SelfQuery &query);

  const Surface &surface_;
  const SelfRest &rest_;
  SelfList &list_;
  std::function<Vec3(uint32_t)> now_;  // velocity of a surfel before the solve
  // m, least d - max(l, min(r, 0.6 D)) of all pairs at the last look that found none near, and d_c then;
  // negative: no such check
  double slack_ = -1, offset_ = 0;
  // of this sub-step: m, of that slack; m/s, no surfel is faster, or than the first one
  double left_ = -1, speed_ = -1;
  Array<double> x_;  // [nsurfel,4] positions at the last look
  // m, by which distances can have fallen since the list was made, up to the last look
  double way_ = 0;
  // m, D of the listed pairs, vertex_face() first; `way_` up to which a pair has slack
  Array<double> apart_, safe_;
  uint64_t renewals_ = 0;  // of the list to which apart_ belongs
};

}  // namespace dfm
