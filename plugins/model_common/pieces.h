// A pass over n items: piece(begin, end), on the host's workers where `parallel`, else one piece here. Pieces
// begin at multiples of the grain.
#pragma once
#include <deform/plugin.h>

namespace model {

template <class Piece>
void in_pieces(const dfm_host *host, bool parallel, uint32_t n, uint32_t grain, const Piece &piece) {
  if (!parallel) return piece(0, n);
  const auto call = [](void *user, uint32_t begin, uint32_t end) {
    (*static_cast<const Piece *>(user))(begin, end);
  };
  host->parallel_for(host->ctx, n, grain, call, const_cast<Piece *>(&piece));
}

}  // namespace model
